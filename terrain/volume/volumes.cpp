// SPDX-License-Identifier: MIT
#include "shapes/operation_bytes.h"

#include <terrane/store/sealed_file.h>
#include <terrane/terrain/number_text.h>
#include <terrane/volume/volumes.h>

#include <algorithm>
#include <utility>

namespace terrane {

struct Volumes::State {
    Lattice lattice;
    int level = 0;
    std::vector<PlacedVolume> operations;
    std::array<std::uint64_t, 2> fingerprint{};
    std::vector<VolumeTileKey> tiles;    // sorted
    std::vector<std::uint32_t> begins;   // [tiles + 1] into indices and parts
    std::vector<std::uint32_t> indices;  // of operations, ascending for each tile
    std::vector<VolumeTilePart> parts;   // of each index

    // First and number of a tile's indices.
    std::pair<std::size_t, std::size_t> range_of(const VolumeTileKey& key) const;
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
    if (operations.empty() && !settings.level)
        return fail(ErrorCode::invalid_argument, "the list of volumes is empty");
    if (settings.level && (*settings.level < 0 || *settings.level > lattice.finest_level)) {
        return fail(ErrorCode::invalid_argument, "level must be 0 to " +
                                                     number_text(lattice.finest_level) + ", got " +
                                                     number_text(*settings.level));
    }
    auto state = std::make_shared<State>();
    state->lattice = lattice;
    const auto named = [](std::size_t i, const Error& error) {
        return fail(error.code, "volume " + number_text(i) + ": " + error.message);
    };
    // Checked first: the level follows from all of them.
    double voxel = operations.empty() ? 1.0 : operations.front().voxel;
    for (std::size_t i = 0; i < operations.size(); ++i) {
        if (auto ok = check(operations[i]); !ok) return named(i, ok.error());
        voxel = std::min(voxel, operations[i].voxel);
    }
    state->level = settings.level.value_or(pinned_level(lattice, voxel));
    struct Touch {
        VolumeTilePart part;
        std::uint32_t index = 0;  // of the operation
    };
    ContentHasher hasher;
    const auto add = [&hasher](const ByteWriter& bytes) { hasher.add(bytes.bytes()); };
    ByteWriter of_lattice;
    for (const double value :
         {lattice.origin_x, lattice.origin_y, lattice.spacing, lattice.quantum})
        of_lattice.put(value);
    for (const std::int32_t value :
         {lattice.first_root_x, lattice.first_root_y, lattice.root_count_x, lattice.root_count_y,
          std::int32_t{lattice.finest_level}, std::int32_t{state->level}})
        of_lattice.put(value);
    add(of_lattice);
    std::vector<Touch> touches;
    for (std::size_t i = 0; i < operations.size(); ++i) {
        auto placed = PlacedVolume::create(lattice, state->level, operations[i], settings);
        if (!placed) return named(i, placed.error());
        for (const VolumeTilePart& part : placed->tiles())
            touches.push_back({part, static_cast<std::uint32_t>(i)});
        ByteWriter of_operation;
        internal::put(of_operation, operations[i]);
        of_operation.put(static_cast<std::uint64_t>(placed->bytes()));
        add(of_operation);
        state->operations.push_back(std::move(*placed));
    }
    state->fingerprint = {hasher.value().low, hasher.value().high};
    std::ranges::sort(touches, {},
                      [](const Touch& touch) { return std::pair(touch.part.key, touch.index); });
    for (const auto& [part, index] : touches) {
        if (state->tiles.empty() || state->tiles.back() != part.key) {
            state->tiles.push_back(part.key);
            state->begins.push_back(static_cast<std::uint32_t>(state->indices.size()));
        }
        state->indices.push_back(index);
        state->parts.push_back(part);
    }
    state->begins.push_back(static_cast<std::uint32_t>(state->indices.size()));
    return Volumes(std::move(state));
}

const Lattice& Volumes::lattice() const { return state_->lattice; }
int Volumes::level() const { return state_->level; }
double Volumes::spacing() const { return state_->lattice.level_spacing(state_->level); }
std::span<const PlacedVolume> Volumes::operations() const { return state_->operations; }
std::array<std::uint64_t, 2> Volumes::fingerprint() const { return state_->fingerprint; }
std::span<const VolumeTileKey> Volumes::tiles() const { return state_->tiles; }

std::pair<std::size_t, std::size_t> Volumes::State::range_of(const VolumeTileKey& key) const {
    const auto found = std::ranges::lower_bound(tiles, key);
    if (found == tiles.end() || *found != key) return {0, 0};
    const auto i = static_cast<std::size_t>(found - tiles.begin());
    return {begins[i], begins[i + 1] - begins[i]};
}

std::span<const std::uint32_t> Volumes::operations_at(const VolumeTileKey& key) const {
    const auto [first, count] = state_->range_of(key);
    return {state_->indices.data() + first, count};
}

std::span<const VolumeTilePart> Volumes::parts_at(const VolumeTileKey& key) const {
    const auto [first, count] = state_->range_of(key);
    return {state_->parts.data() + first, count};
}

}  // namespace terrane
