// SPDX-License-Identifier: MIT
#include <terrane/terrain/number_text.h>
#include <terrane/volume/volumes.h>

#include <algorithm>

namespace terrane {

struct Volumes::State {
    Lattice lattice;
    int level = 0;
    std::vector<PlacedVolume> operations;
    std::vector<VolumeTileKey> tiles;    // sorted
    std::vector<std::uint32_t> begins;   // [tiles + 1] into indices
    std::vector<std::uint32_t> indices;  // of operations, ascending for each tile
};

int pinned_level(const Lattice& lattice, double voxel) {
    const auto ratio = [&](int level) {
        const double spacing = lattice.level_spacing(level);
        return std::max(spacing / voxel, voxel / spacing);
    };
    int best = lattice.finest_level;
    for (int level = lattice.finest_level - 1; level >= 0; --level) {
        if (ratio(level) < ratio(best)) best = level;
    }
    return best;
}

Result<Volumes> Volumes::create(const Lattice& lattice, std::span<const VolumeOperation> operations,
                                const VolumeSettings& settings) {
    if (auto ok = check(lattice); !ok) return tl::unexpected(ok.error());
    if (operations.empty())
        return fail(ErrorCode::invalid_argument, "the list of volumes is empty");
    auto state = std::make_shared<State>();
    state->lattice = lattice;
    const auto named = [](std::size_t i, const Error& error) {
        return fail(error.code, "volume " + number_text(i) + ": " + error.message);
    };
    // Checked first: the level follows from all of them.
    double voxel = operations.front().voxel;
    for (std::size_t i = 0; i < operations.size(); ++i) {
        if (auto ok = check(operations[i]); !ok) return named(i, ok.error());
        voxel = std::min(voxel, operations[i].voxel);
    }
    state->level = pinned_level(lattice, voxel);
    std::vector<std::pair<VolumeTileKey, std::uint32_t>> touches;
    for (std::size_t i = 0; i < operations.size(); ++i) {
        auto placed = PlacedVolume::create(lattice, state->level, operations[i], settings);
        if (!placed) return named(i, placed.error());
        for (const VolumeTileKey& key : placed->tiles())
            touches.emplace_back(key, static_cast<std::uint32_t>(i));
        state->operations.push_back(std::move(*placed));
    }
    std::ranges::sort(touches);
    for (const auto& [key, index] : touches) {
        if (state->tiles.empty() || state->tiles.back() != key) {
            state->tiles.push_back(key);
            state->begins.push_back(static_cast<std::uint32_t>(state->indices.size()));
        }
        state->indices.push_back(index);
    }
    state->begins.push_back(static_cast<std::uint32_t>(state->indices.size()));
    return Volumes(std::move(state));
}

const Lattice& Volumes::lattice() const { return state_->lattice; }
int Volumes::level() const { return state_->level; }
double Volumes::spacing() const { return state_->lattice.level_spacing(state_->level); }
std::span<const PlacedVolume> Volumes::operations() const { return state_->operations; }
std::span<const VolumeTileKey> Volumes::tiles() const { return state_->tiles; }

std::span<const std::uint32_t> Volumes::operations_at(const VolumeTileKey& key) const {
    const auto found = std::ranges::lower_bound(state_->tiles, key);
    if (found == state_->tiles.end() || *found != key) return {};
    const auto i = static_cast<std::size_t>(found - state_->tiles.begin());
    return {state_->indices.data() + state_->begins[i], state_->begins[i + 1] - state_->begins[i]};
}

}  // namespace terrane
