// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/composed_heights.h>

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
#include <utility>
#include <vector>

namespace terrane::test {

/// A fault injected into a call of a source.
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

/// Kinds of calls that a rule can select.
enum class Question {
    any,
    sample,
    bounds,  ///< of vertices, of cells, or of both
    flags,
};

/// Selects calls and injects a fault. A call must match all fields.
struct FaultRule {
    Fault fault = Fault::none;
    std::chrono::milliseconds delay{0};  ///< before each matching call, with or without a fault
    Question question = Question::any;
    std::optional<WorldRect> area = std::nullopt;  ///< grids that overlap it
    std::optional<ChunkKey> chunk = std::nullopt;  ///< grids that make_chunk() reads for this chunk
    int passes = 0;                                ///< matching calls before the first fault
    int times = std::numeric_limits<int>::max();   ///< calls with the fault after those
    /// Share of these calls that fail. The choice depends on seed, call, grid and repetition, not on thread order.
    double share = 1.0;
    std::uint64_t seed = 1;
};

/// A source with injected faults. Threads: any, for all functions.
class FaultyHeights final : public ForwardedHeights {
public:
    /// For each call the first matching rule applies.
    explicit FaultyHeights(std::shared_ptr<const HeightSource> ground,
                           std::vector<FaultRule> plan = {});

    /// Resets the counts of all rules. Calls that hang from now on wait for another release().
    void set_plan(std::vector<FaultRule> plan);
    /// Releases all calls that hang now or will hang under the current plan.
    void release();
    /// Waits until `count` calls hang.
    void wait_for_hung(int count) const;
    /// Calls for grids so far.
    int question_count() const;
    /// Chunks whose samples were read, in order.
    std::vector<ChunkKey> sampled() const;

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;

private:
    struct Rule {
        FaultRule rule;
        int match_count = 0;
    };
    using GridName = std::tuple<Question, LatticePoint, std::int64_t, int>;

    bool matches(const FaultRule& rule, Question question, const SampleGrid& grid) const;
    FaultRule find_rule(Question question, const SampleGrid& grid) const;
    Result<Fault> meet(Question question, const SampleGrid& grid) const;

    mutable std::mutex mutex_;  // of everything below
    mutable std::condition_variable changed_;
    mutable std::vector<Rule> plan_;
    mutable std::map<GridName, std::uint64_t> asked_;  // calls per grid
    mutable std::vector<ChunkKey> sampled_;
    mutable int question_count_ = 0;
    mutable int hung_count_ = 0;
    std::uint64_t plan_count_ = 0;
    std::uint64_t released_plans_ = 0;
};

/// The chunk whose samples, or for a root coarser samples, are read by this grid; chosen by the grid's centre.
ChunkKey chunk_of(const Lattice& lattice, const SampleGrid& grid);

/// A source whose samples are stored in a file that every call opens, reads and closes: for tests that truncate,
/// corrupt or remove the file. Bounds, and samples beyond the world, come from the ground that the file was written
/// from.
///
/// Format: the world's lattice points row by row from the south, eight bytes each; each row is followed by a checksum
/// of eight bytes.
class FileHeights final : public ForwardedHeights {
public:
    /// Writes the samples of a ground, replacing an existing file.
    ///
    /// Fails: io if it cannot be written
    static Result<void> write(const std::string& path, const HeightSource& ground);
    /// Byte offset of a row of lattice points.
    static std::size_t row_offset(const Lattice& lattice, std::int64_t y);

    FileHeights(std::string path, std::shared_ptr<const HeightSource> ground)
        : ForwardedHeights(std::move(ground)), path_(std::move(path)) {}

    /// Fails: io if the file cannot be opened or read; bad_data if it ends early or a row does not match its checksum
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;

    /// Opens the file as an unprivileged user, where the process may change its user, because root ignores permissions.
    std::atomic<bool> opens_as_nobody{false};

private:
    std::string path_;
};

/// During its lifetime this process has no free file handles.
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
