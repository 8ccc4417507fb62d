// SPDX-License-Identifier: MIT
#include "lod/selection.h"

#include <algorithm>
#include <bit>

namespace terrane::internal {
namespace {

// Bits of KeyCandidate::vertex: area, kind, square.
constexpr unsigned kAreaShift = 8, kKindShift = 6;
constexpr std::uint16_t kNoVertex = 0xffffu;  // a vertex that is not in an area
// Capacity of a worker's window, in keys. A chunk adds at most as many keys as it has samples.
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
    for (Tally& tally : tallies_) tally.candidates.resize(kWindowCapacity);
    candidates_.reserve(kWindowCapacity * tallies_.size());
}

KeyWindow& Selection::window(int worker) {
    Tally& tally = tallies_[static_cast<std::size_t>(worker)];
    if (tally.window.count + OpenChunk::kSamples > kWindowCapacity) {
        tally.is_full = true;
        tally.window.count = 0;
    }
    return tally.window;
}

AreaPlace Selection::place_of(const OpenChunk& chunk, int area, AreaVertices::Kind kind) {
    AreaPlace place;
    place.chunk = chunk.place;
    place.first = static_cast<std::uint16_t>((static_cast<std::size_t>(area) << kAreaShift) +
                                             (kind << kKindShift));
    constexpr std::uint64_t kFirstColumn = 0x0101010101010101u, kFirstRow = 0xffu;
    if (kind == AreaVertices::along_x && is_world_border(chunk, area, south))
        place.border = kFirstRow;
    if (kind == AreaVertices::along_y && is_world_border(chunk, area, west))
        place.border = kFirstColumn;
    return place;
}

// Counts the keys of a chunk's areas in the current window, and sets the bits of those below it.
void Selection::count_chunk(OpenChunk& chunk, const KeyKernels& kernels, int worker) {
    KeyWindow& window = this->window(worker);
    chunk.clear_bits();
    for_each_bit(chunk.open_areas, [&](int area) {
        for (const auto kind :
             {AreaVertices::centre, AreaVertices::along_x, AreaVertices::along_y}) {
            chunk.set_bits(area, kind,
                           kernels.count(chunk.keys_of(area)[kind].data(),
                                         place_of(chunk, area, kind), window));
        }
    });
    add_others(chunk, worker);
}

void Selection::add_others(const OpenChunk& chunk, int worker) {
    KeyWindow& window = this->window(worker);
    const auto add = [&](float key, std::uint16_t triangles) {
        if (key < window.low) {
            window.below += triangles;
        } else if (key < window.high) {
            window.candidates[window.count++] = {key, chunk.place, kNoVertex, triangles};
        }
    };
    for (const Side side : {east, north}) {
        if (!chunk.at_world_border[side]) continue;
        for (const float key : side == east ? chunk.east_keys : chunk.north_keys) add(key, 1);
    }
    if (!chunk.is_root()) return;
    // vertices on a line between roots are counted with the root to the east or north of it
    constexpr std::size_t kLast = OpenChunk::kCoarseSide - 1;
    for (std::size_t row = 0; row <= kLast; ++row) {
        if (row == kLast && !chunk.at_world_border[north]) break;
        const bool is_end = row == 0 ? chunk.at_world_border[south] : row == kLast;
        const float* const keys = chunk.coarse_keys.data() + row * OpenChunk::kCoarseSide;
        add(keys[0], is_end || chunk.at_world_border[west] ? 1 : 2);
        for (std::size_t column = 1; column < kLast; ++column) add(keys[column], is_end ? 1 : 2);
        if (is_end || chunk.at_world_border[east]) add(keys[kLast], 1);
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
        tally.is_full = false;
        tally.window = {low, high, tally.candidates.data(), 0, 0};
    }
}

std::size_t Selection::below() const {
    std::size_t below = others_below(window_low_);
    for (const Tally& tally : tallies_) below += tally.window.below;
    return below;
}

// Counts all keys again. Returns the weight of the keys below `low`, and collects those in [low, high) in the windows
// unless these are full.
std::size_t Selection::count(std::span<OpenChunk* const> open, const KeyKernels& kernels, float low,
                             float high, WorkerTeam& team) {
    open_windows(low, high);
    team.run(open.size(),
             [&](std::size_t i, int worker) { count_chunk(*open[i], kernels, worker); });
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
    const float threshold = search(open, kernels, budget, team);
    const bool is_full =
        std::ranges::any_of(tallies_, [](const Tally& tally) { return tally.is_full; });
    if (is_full || threshold < window_low_ || threshold > window_high_) {
        count(open, kernels, threshold, threshold, team);
    }
    for (const Tally& tally : tallies_) {
        for (const KeyCandidate& candidate : tally.inside()) {
            if (!(candidate.key < threshold) || candidate.vertex == kNoVertex) continue;
            OpenChunk& chunk = *open[candidate.chunk];
            const std::size_t kind = candidate.vertex >> kKindShift & 3;
            chunk.bits[candidate.vertex >> kAreaShift].of(kind) |=
                std::uint64_t{1} << (candidate.vertex % AreaVertices::kSquares);
            ++(kind == AreaVertices::centre ? chunk.centre_count : chunk.midpoint_count);
        }
    }
    return threshold;
}

float Selection::search(std::span<OpenChunk* const> open, const KeyKernels& kernels,
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
            for (const KeyCandidate& candidate : tally.inside()) inside += candidate.triangles;
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
            for (const KeyCandidate& candidate : tally.inside()) {
                use(candidate.key, std::uint32_t{candidate.triangles});
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
