// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace terrane::test {

/// A fault of a call of a source.
enum class Fault {
    none,
    read_error,         ///< fails with io
    permission_denied,  ///< fails with io
    truncated,          ///< fails with bad_data
    nan,                ///< one value is NaN
    too_high,           ///< one height exceeds kMostQuanta; bounds and flags are right
    no_memory,          ///< throws std::bad_alloc
    exception,          ///< throws std::runtime_error
    odd_exception,      ///< throws something that is no std::exception
    hang,               ///< blocks until release(), then answers correctly
};

/// The calls of a source for a grid.
enum class Question {
    any,
    sample,
    bounds,  ///< of vertices, cells, or both
    flags,
};

/// A rule for the calls with a fault. A call must match all of its fields.
struct FaultRule {
    Fault fault = Fault::none;
    std::chrono::milliseconds delay{0};  ///< before the call, also without a fault
    Question question = Question::any;
    std::optional<WorldRect> area = std::nullopt;  ///< of grids that touch it
    std::optional<ChunkKey> chunk =
        std::nullopt;  ///< of grids that make_chunk() reads for this chunk
    int passes = 0;    ///< number of matching calls without the fault
    int times = std::numeric_limits<int>::max();  ///< then the number of calls with it
    /// Share of those; chosen by seed, call, grid and the number of repetitions, independent of the order of threads.
    double share = 1.0;
    std::uint64_t seed = 1;
};

/// A source with planned faults. Threads: any, for all functions.
class FaultyHeights final : public HeightSource {
public:
    /// The first matching rule of a plan applies.
    explicit FaultyHeights(std::shared_ptr<const HeightSource> ground,
                           std::vector<FaultRule> plan = {});

    /// Resets the counts of rules; calls that hang from now on wait for another release().
    void set_plan(std::vector<FaultRule> plan);
    /// Releases hanging calls, and future ones.
    void release();
    /// Waits until a number of calls hang.
    void wait_for_hung(int count) const;
    /// Number of calls for grids so far.
    int question_count() const;
    /// The chunks whose samples were read, in order.
    std::vector<ChunkKey> sampled() const;

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

private:
    struct Rule {
        FaultRule rule;
        int match_count = 0;
    };
    using GridName = std::tuple<Question, LatticePoint, std::int64_t, int>;

    bool matches(const FaultRule& rule, Question question, const SampleGrid& grid) const;
    FaultRule find_rule(Question question, const SampleGrid& grid) const;
    Result<Fault> meet(Question question, const SampleGrid& grid) const;

    std::shared_ptr<const HeightSource> ground_;
    mutable std::mutex mutex_;  // of everything below
    mutable std::condition_variable changed_;
    mutable std::vector<Rule> plan_;
    mutable std::map<GridName, std::uint64_t> asked_;  // how often
    mutable std::vector<ChunkKey> sampled_;
    mutable int question_count_ = 0;
    mutable int hung_count_ = 0;
    std::uint64_t plan_count_ = 0;
    std::uint64_t released_plans_ = 0;
};

/// The chunk that reads a grid of its own spacing or, for a root, a coarser one; by the grid's middle.
ChunkKey chunk_of(const Lattice& lattice, const SampleGrid& grid);

/// A source whose samples are in a file that is opened, read and closed in every call: for tests that truncate it,
/// change a byte, or remove it. Bounds, and samples beyond the world, are those of the ground that it was
/// written from.
///
/// The file: row by row from the south of the world's lattice points, eight bytes each, and behind each row a
/// checksum of eight bytes.
class FileHeights final : public HeightSource {
public:
    /// Writes the samples of a ground, replacing the file.
    ///
    /// Fails: io if it cannot be written
    static Result<void> write(const std::string& path, const HeightSource& ground);
    /// Offset of the record of a row of lattice points.
    static std::size_t row_offset(const Lattice& lattice, std::int64_t y);

    FileHeights(std::string path, std::shared_ptr<const HeightSource> ground);

    /// Fails: io where the file cannot be opened or read; bad_data where it ends early, or a row does
    ///        not have its checksum
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;

    double height(double x, double y) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

    /// Opens the file as an unprivileged user, if this process may change its user: root ignores permissions.
    std::atomic<bool> opens_as_nobody{false};

private:
    std::string path_;
    std::shared_ptr<const HeightSource> ground_;
};

/// While it lives, this process has no free file handles.
class NoFileHandles {
public:
    NoFileHandles();
    ~NoFileHandles();
    NoFileHandles(const NoFileHandles&) = delete;
    NoFileHandles& operator=(const NoFileHandles&) = delete;

private:
    rlimit before_{};
};

}  // namespace terrane::test
