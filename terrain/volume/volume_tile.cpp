// SPDX-License-Identifier: MIT
#include "contour/tile_contour.h"

#include <terrane/terrain/assert.h>
#include <terrane/volume/volume_tile.h>

namespace terrane {

using internal::Field;

struct VolumeTile::State {
    VolumeTileKey key;
    internal::TileLines lines;
    internal::TileLevelSet level_set;

    State(const VolumeTileKey& key_, const internal::TileLines& lines_)
        : key(key_), lines(lines_), level_set(lines_.spacing) {}
};

VolumeTile::VolumeTile(std::unique_ptr<State> state) : state_(std::move(state)) {}
VolumeTile::VolumeTile(VolumeTile&&) noexcept = default;
VolumeTile& VolumeTile::operator=(VolumeTile&&) noexcept = default;
VolumeTile::~VolumeTile() = default;

Result<VolumeTile> VolumeTile::create(const Volumes& volumes, const VolumeTileKey& key,
                                      std::span<const std::int32_t> heights) {
    auto lines = internal::TileLines::create(volumes.lattice(), volumes.level(), key, heights);
    if (!lines) return tl::unexpected(lines.error());
    VolumeTile tile(std::make_unique<State>(key, *lines));
    for (const std::uint32_t i : volumes.operations_at(key)) tile.apply(volumes.operations()[i]);
    return tile;
}

void VolumeTile::apply(const PlacedVolume& volume) {
    state_->level_set.apply(volume.op(), volume.shape(), state_->lines);
}

VolumeContour VolumeTile::contour() const {
    return internal::contour_tile(state_->level_set, state_->lines, state_->key);
}

VolumeTile::NodeDistances VolumeTile::distances(int column, int row, std::int32_t k) const {
    TERRANE_ASSERT(
        column >= 0 && column < kVolumeTileSamples && row >= 0 && row < kVolumeTileSamples,
        "a line of the tile");
    const int line = internal::line_index(column, row);
    return {state_->level_set.value(Field::to_void, line, k),
            state_->level_set.value(Field::to_solid, line, k)};
}

WorldPos VolumeTile::position(int column, int row, std::int32_t k) const {
    return state_->lines.position(internal::line_index(column, row), k);
}

std::size_t VolumeTile::bytes() const { return sizeof(State) + state_->level_set.bytes(); }
std::uint64_t VolumeTile::band_node_count() const { return state_->level_set.band_node_count(); }

}  // namespace terrane
