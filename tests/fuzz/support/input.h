// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// A fuzz target: libFuzzer or replay_main.cpp calls it with the bytes of one input. Returns 0; -1: the input is not to
/// be kept in the corpus. Aborts where a promise of the library is broken.
// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace terrane::fuzz {

/// Aborts with a message where a promise is broken.
inline void require(bool is_kept, const char* promise) {
    if (is_kept) return;
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}
inline void require(bool is_kept, const std::string& promise) { require(is_kept, promise.c_str()); }

/// Whether a result has a value. Aborts where its error has no message.
template <class AnyResult>
bool is_accepted(const AnyResult& result) {
    if (!result) require(!result.error().message.empty(), "a refusal has a message");
    return result.has_value();
}

/// Whether a query has an answer, which may lack contacts.
inline bool is_answer(QueryStatus status) {
    return status == QueryStatus::ok || status == QueryStatus::truncated;
}

/// Takes values from the front of the bytes of an input. After the end all bytes are 0.
class Input {
public:
    Input(const std::uint8_t* data, std::size_t size) : bytes_(data, size) {}

    bool is_empty() const { return bytes_.empty(); }
    std::uint8_t byte();
    bool flag() { return (byte() & 1) != 0; }
    /// @param count above 0
    int below(int count) { return byte() % count; }
    /// One of some values.
    template <class T, std::size_t kCount>
    const T& one_of(const std::array<T, kCount>& values) {
        return values[static_cast<std::size_t>(below(static_cast<int>(kCount)))];
    }
    /// `width` bytes, little-endian.
    std::uint64_t bits(int width);
    /// Evenly spaced values of 16 bits, low and high included.
    double between(double low, double high);
    /// Mostly low to high; where the first byte is 255 any bits of a double follow, NaN and infinities included.
    double number(double low, double high);
    /// Mostly a point of the box from (low, low, low) to (high, high, high); see number().
    Eigen::Vector3d vector(double low, double high);
    /// Mostly a rotation; else any matrix.
    Eigen::Matrix3d rotation();
    /// At most `most` bytes.
    std::span<const std::uint8_t> bytes(std::size_t most);
    /// All bytes that are left.
    std::span<const std::uint8_t> rest() { return bytes(bytes_.size()); }
    std::string_view rest_as_text();
    /// The lines of all that is left, at most `most`.
    std::vector<std::string_view> rest_as_lines(std::size_t most);

private:
    std::span<const std::uint8_t> bytes_;
};

/// A shape that mostly is valid: sphere, capsule, box, hull of up to 12 points or compound of up to 4 parts, mostly of
/// sizes 0 to 8 m.
Shape take_shape(Input& input);
/// A sphere, capsule or box of 0.05 to 4 m.
Shape take_simple_shape(Input& input);
/// A pose that mostly is valid, mostly with a translation from `low` to `high`.
Pose take_pose(Input& input, double low, double high);
/// From a pose along a translation and a rotation of up to `reach` metres and a turn.
Motion take_motion(Input& input, double low, double high, double reach);

/// One of some difficult grounds over [0, 128]^2 with cells of 1 m: planes, stairs, spikes, walls, pits, rough. Made
/// once.
const Ground& take_ground(Input& input);

/// Fractal ground of one root square of 128 x 128 cells, whose south-west corner is (0, 0).
///
/// @param spacing_log2 of the cells, metres
std::shared_ptr<const HeightSource> make_square(double amplitude, int spacing_log2);

/// Whether a vector has length 1 to 1e-6.
bool is_unit(const Eigen::Vector3d& v);

/// A file as an input describes it: a valid file with changes. So the corpus stays small, and stays valid when a format
/// of ours changes, because the target makes the valid file itself.
///
/// The rest of the input is a list of changes: a byte that says which, an offset of 16 bits (modulo the size), a length
/// of a byte where one is needed, and the bytes that are written. Changes overwrite, insert, erase, cut off the end or
/// repeat a range.
std::vector<std::uint8_t> patched(std::vector<std::uint8_t> file, Input& input);

/// A folder of this process for readers that take paths, removed at the end of the process.
class ScratchFolder {
public:
    ScratchFolder();
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::string& path() const { return path_; }
    /// Writes or replaces a file; aborts where that fails. Returns its path.
    std::string write(const std::string& name, std::span<const std::uint8_t> bytes) const;
    std::string write(const std::string& name, std::string_view text) const;

private:
    std::string path_;
};

}  // namespace terrane::fuzz
