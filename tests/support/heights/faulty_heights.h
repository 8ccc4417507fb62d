// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>
#include <vector>

namespace terrane::test {

/// What goes wrong with a question to a source.
enum class Fault {
    none,
    read_error,         ///< fails with io
    permission_denied,  ///< fails with io
    truncated,          ///< fails with bad_data
    nan,                ///< one value is NaN
    too_high,       ///< one height has more quanta than a chunk takes; bounds and flags are right
    no_memory,      ///< throws std::bad_alloc
    exception,      ///< throws std::runtime_error
    odd_exception,  ///< throws what is no std::exception
    hang,           ///< no answer before release(); then the right one
};

/// What a source can be asked for a grid.
enum class Question {
    any,
    sample,
    bounds,  ///< of vertices, cells, or both
    flags,
};

/// Which questions meet a fault. A question has to match all of it.
struct FaultRule {
    Fault fault = Fault::none;
    std::chrono::milliseconds delay{0};  ///< before it, also where nothing goes wrong
    Question question = Question::any;
    std::optional<WorldRect> area = std::nullopt;  ///< of grids that touch it
    std::optional<ChunkKey> chunk =
        std::nullopt;  ///< of grids that make_chunk() asks for to make it
    int passes = 0;    ///< so many of those are let through
    int times = std::numeric_limits<int>::max();  ///< and then so many meet it
    /// Of those; chosen by seed, question, grid and how often it was asked: the same ones whatever the
    /// order in which threads ask.
    double share = 1.0;
    std::uint64_t seed = 1;
};

/// A source in whose way faults are put by plan. Threads: any, for everything.
class FaultyHeights final : public HeightSource {
public:
    /// The first rule of a plan that holds for a question counts.
    explicit FaultyHeights(std::shared_ptr<const HeightSource> ground,
                           std::vector<FaultRule> plan = {});

    /// What rules count begins anew, and what hangs from now on waits for another release().
    void set_plan(std::vector<FaultRule> plan);
    /// Lets calls that hang go, and those that would.
    void release();
    /// Waits until so many calls hang.
    void wait_for_hung(int count) const;
    /// Questions for grids so far.
    int question_count() const;
    /// The chunks that samples were asked for, in that order.
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

/// The chunk that asks for a grid of its own spacing or, a root, a coarser one; by the grid's middle.
ChunkKey chunk_of(const Lattice& lattice, const SampleGrid& grid);

}  // namespace terrane::test
