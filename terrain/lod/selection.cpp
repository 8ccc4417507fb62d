// SPDX-License-Identifier: MIT
#include "lod/selection.h"

#include <algorithm>
#include <bit>

namespace terrane::internal {
namespace {

// Capacity of a worker's windows, in keys. A chunk adds at most as many keys as it has samples.
constexpr std::size_t kWindowCapacity = std::size_t{1} << 17;
// The first window extends by this factor to either side of its middle key: 1 % in pixels.
constexpr float kFirstWidth = 1.02f;

// Positive floats have the order of their bit patterns.
std::uint32_t bits_of(float key) { return std::bit_cast<std::uint32_t>(key); }

float middle(float low, float high) {
    return std::bit_cast<float>(bits_of(low) + (bits_of(high) - bits_of(low)) / 2);
}

}  // namespace

Selection::Selection(int worker_count)
    : tallies_(static_cast<std::size_t>(worker_count)), others_weight_(1, 0) {
    for (Tally& tally : tallies_) {
        for (auto& keys : tally.inside) keys.resize(kWindowCapacity);
    }
    candidates_.reserve(2 * kWindowCapacity * tallies_.size());
}

void Selection::count_chunk(const OpenChunk& chunk, const KeyKernels& kernels, Tally& tally) const {
    KeyWindow& inner = tally.window[0];
    KeyWindow& border = tally.window[1];
    if (inner.count + OpenChunk::kSamples > kWindowCapacity ||
        border.count + OpenChunk::kSamples > kWindowCapacity) {
        tally.is_full = true;
        inner.count = border.count = 0;
    }
    const auto count_inner = [&](const float* keys, std::size_t number) {
        tally.below += 2 * std::size_t{kernels.count(keys, static_cast<int>(number), inner)};
    };
    const auto count_border = [&](const float* keys, std::size_t number) {
        tally.below += kernels.count(keys, static_cast<int>(number), border);
    };
    for_each_bit(chunk.open_areas, [&](int area) {
        const OpenChunk::Keys& keys = chunk.keys_of(area);
        constexpr std::size_t kSquares = AreaVertices::kSquares;
        const bool south_ends = is_world_border(chunk, area, south);
        const bool west_ends = is_world_border(chunk, area, west);
        if (!south_ends && !west_ends) {
            count_inner(keys[0].data(), AreaVertices::kKinds * kSquares);
            return;
        }
        count_inner(keys[AreaVertices::centre].data(), kSquares);
        const float* along_x = keys[AreaVertices::along_x].data();
        const std::size_t first = south_ends ? kAreaSquares : 0;
        count_border(along_x, first);
        count_inner(along_x + first, kSquares - first);
        for (std::size_t i = 0; i < kSquares; i += kAreaSquares) {
            const float* along_y = keys[AreaVertices::along_y].data() + i;
            const std::size_t outer = west_ends ? 1 : 0;
            count_border(along_y, outer);
            count_inner(along_y + outer, kAreaSquares - outer);
        }
    });
    if (chunk.at_world_border[east]) count_border(chunk.east_keys.data(), chunk.east_keys.size());
    if (chunk.at_world_border[north])
        count_border(chunk.north_keys.data(), chunk.north_keys.size());
    if (chunk.is_root()) count_coarse(chunk, kernels, tally);
}

// Vertices on a line between roots are counted with the root to the east or north of it.
void Selection::count_coarse(const OpenChunk& root, const KeyKernels& kernels, Tally& tally) const {
    constexpr int kLast = kChunkSquares;
    const auto side = static_cast<int>(OpenChunk::kCoarseSide);
    for (int row = 0; row <= kLast; ++row) {
        if (row == kLast && !root.at_world_border[north]) break;
        const float* keys = root.coarse_keys.data() + row * side;
        if ((row == 0 && root.at_world_border[south]) || row == kLast) {
            tally.below += kernels.count(keys, side, tally.window[1]);
            continue;
        }
        const int first = root.at_world_border[west] ? 1 : 0;
        tally.below += kernels.count(keys, first, tally.window[1]);
        tally.below += 2 * std::size_t{kernels.count(keys + first, kLast - first, tally.window[0])};
        if (root.at_world_border[east])
            tally.below += kernels.count(keys + kLast, 1, tally.window[1]);
    }
}

void Selection::set_others(std::span<const WeightedKey> others) {
    others_.assign(others.begin(), others.end());
    std::sort(others_.begin(), others_.end(),
              [](const WeightedKey& a, const WeightedKey& b) { return a.key < b.key; });
    others_weight_.assign(1, 0);
    for (const WeightedKey& other : others_)
        others_weight_.push_back(others_weight_.back() + other.weight);
}

std::size_t Selection::others_below(float key) const {
    const auto first =
        std::lower_bound(others_.begin(), others_.end(), key,
                         [](const WeightedKey& other, float least) { return other.key < least; });
    return others_weight_[static_cast<std::size_t>(first - others_.begin())];
}

std::span<const WeightedKey> Selection::others_inside() const {
    const auto is_below = [](const WeightedKey& other, float least) { return other.key < least; };
    const auto first = std::lower_bound(others_.begin(), others_.end(), window_low_, is_below);
    return {first, std::lower_bound(first, others_.end(), window_high_, is_below)};
}

void Selection::open_windows(float low, float high) {
    window_low_ = low;
    window_high_ = high;
    for (Tally& tally : tallies_) {
        tally.below = 0;
        tally.is_full = false;
        for (std::size_t i = 0; i < 2; ++i) {
            tally.window[i] = {low, high, tally.inside[i].data(), 0};
        }
    }
}

std::size_t Selection::below() const {
    std::size_t below = others_below(window_low_);
    for (const Tally& tally : tallies_) below += tally.below;
    return below;
}

// Returns the weight of the keys below `low`, and collects those in [low, high) in the windows unless these are full.
std::size_t Selection::count(std::span<OpenChunk* const> open, const KeyKernels& kernels, float low,
                             float high, WorkerTeam& team) {
    open_windows(low, high);
    team.run(open.size(), [&](std::size_t i, int worker) { add(*open[i], kernels, worker); });
    return below();
}

void Selection::begin(float floor, float guess) {
    const float middle_key = guess > 0.0f ? guess : floor;
    floor_ = floor;
    low_ = std::clamp(middle_key / kFirstWidth, 0.0f, floor);
    high_ = std::clamp(middle_key * kFirstWidth, low_, floor);
    open_windows(low_, high_);
}

float Selection::find(std::span<OpenChunk* const> open, const KeyKernels& kernels,
                      std::size_t budget, WorkerTeam& team) {
    float least = 0.0f;   // vertices with smaller keys than this fit into the budget
    float most = floor_;  // vertices with smaller keys than this do not, unless it is the floor
    float low = low_, high = high_;
    bool is_counted = true;
    for (float spread = kFirstWidth * kFirstWidth;; spread *= spread) {
        const std::size_t below =
            is_counted ? this->below() : count(open, kernels, low, high, team);
        is_counted = false;
        std::size_t inside = others_below(high) - others_below(low);
        bool is_full = false;
        for (const Tally& tally : tallies_) {
            inside += 2 * std::size_t{tally.window[0].count} + tally.window[1].count;
            is_full |= tally.is_full;
        }
        if (below > budget) {
            most = low;
            high = low;
            low = std::max(least, low / spread);
            if (bits_of(high) - bits_of(least) <= 1) return least;
        } else if (is_full) {
            // too many keys to collect: bisects the window; if all keys are equal, their vertices are selected together
            const bool is_one_key = bits_of(high) - bits_of(low) <= 1;
            const float halfway = is_one_key ? high : middle(low, high);
            if (count(open, kernels, halfway, halfway, team) > budget) {
                if (is_one_key) return low;
                most = high = halfway;
            } else if (halfway == floor_) {
                return floor_;
            } else {
                least = low = halfway;
                if (is_one_key) high = std::min(most, high * spread);
            }
        } else if (below + inside <= budget) {
            if (high == floor_) return floor_;
            least = high;
            low = high;
            high = std::min(most, high * spread);
        } else {
            break;
        }
    }

    return pick(low, high, below(), budget);
}

// Finds where in the windows the budget ends: first the bin, then the key in this bin.
float Selection::pick(float low, float high, std::size_t used, std::size_t budget) {
    bins_.fill(0);
    // double, so that neither the width of the smallest window nor its inverse is out of range
    const double per_key =
        static_cast<double>(bins_.size()) / (static_cast<double>(high) - static_cast<double>(low));
    const auto bin_of = [&](float key) {
        const double above = static_cast<double>(key) - static_cast<double>(low);
        return std::min(static_cast<std::size_t>(above * per_key), bins_.size() - 1);
    };
    const auto for_all = [&](const auto& use) {
        for (const Tally& tally : tallies_) {
            for (std::uint32_t i = 0; i < 2; ++i) {
                for (std::uint32_t k = 0; k < tally.window[i].count; ++k) {
                    use(tally.inside[i][k], 2 - i);
                }
            }
        }
        for (const WeightedKey& other : others_inside()) use(other.key, other.weight);
    };
    for_all([&](float key, std::uint32_t weight) { bins_[bin_of(key)] += weight; });
    std::size_t bin = 0;
    while (used + bins_[bin] <= budget) used += bins_[bin++];
    candidates_.clear();
    for_all([&](float key, std::uint32_t weight) {
        if (bin_of(key) == bin) candidates_.push_back({key, weight});
    });
    std::sort(candidates_.begin(), candidates_.end(),
              [](const WeightedKey& a, const WeightedKey& b) { return a.key < b.key; });
    for (auto group = candidates_.begin();;) {
        const float key = group->key;
        for (; group != candidates_.end() && group->key == key; ++group) used += group->weight;
        if (used > budget) return key;
    }
}

}  // namespace terrane::internal
