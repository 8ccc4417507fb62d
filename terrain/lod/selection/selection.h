// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A key, and the triangles that it stands for.
struct WeightedKey {
    float key = 0.0f;
    std::uint32_t weight = 0;
};

/// Finds the threshold that spends a budget: an exact order statistic of the keys of all open vertices, and of those
/// of others that share the budget.
///
/// A vertex weighs as many triangles as it adds: 2 inside the world, 1 on its border.
class Selection {
public:
    explicit Selection(int worker_count);

    /// The keys of others, for searches from now on.
    ///
    /// Allocates: nothing where there were as many before
    void set_others(std::span<const WeightedKey> others);

    /// Begins a search. Then every open chunk must be added once; best right after its keys are computed, while they
    /// are cached.
    ///
    /// @param guess  expected threshold, 0 if unknown; affects the time only
    void begin(float floor, float guess);
    void add(const OpenChunk& chunk, const KeyKernels& kernels, int worker) {
        count_chunk(chunk, kernels, tallies_[static_cast<std::size_t>(worker)]);
    }

    /// The largest threshold, at most the floor, such that the vertices with keys below it weigh at most `budget`.
    /// Vertices of equal keys are in or out together.
    float find(std::span<OpenChunk* const> open, const KeyKernels& kernels, std::size_t budget,
               WorkerTeam& team);

private:
    // Counts of one worker.
    struct Tally {
        std::size_t below = 0;         // their total weight
        std::vector<float> inside[2];  // keys of weight 2, of weight 1
        KeyWindow window[2];
        bool is_full = false;
    };
    void count_chunk(const OpenChunk& chunk, const KeyKernels& kernels, Tally& tally) const;
    void count_coarse(const OpenChunk& root, const KeyKernels& kernels, Tally& tally) const;
    void open_windows(float low, float high);
    std::size_t count(std::span<OpenChunk* const> open, const KeyKernels& kernels, float low,
                      float high, WorkerTeam& team);
    std::size_t below() const;
    std::size_t others_below(float key) const;
    std::span<const WeightedKey> others_inside() const;

    float pick(float low, float high, std::size_t used, std::size_t budget);

    float floor_ = 0.0f;
    float low_ = 0.0f, high_ = 0.0f;                // the first window
    float window_low_ = 0.0f, window_high_ = 0.0f;  // the current window
    std::vector<Tally> tallies_;
    std::vector<WeightedKey> others_;         // ascending
    std::vector<std::size_t> others_weight_;  // [others_ + 1] total of those before
    std::vector<WeightedKey> candidates_;
    std::array<std::size_t, 1024> bins_{};
};

}  // namespace terrane::internal
