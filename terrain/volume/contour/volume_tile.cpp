// SPDX-License-Identifier: MIT
#include "contour/tile_contour.h"

#include <terrane/base/result.h>
#include <terrane/volume/volume_tile.h>

#include <cmath>

namespace terrane {

using internal::Field;

struct VolumeTile::State {
    VolumeTileKey key;
    Lattice lattice;
    int level = 0;
    std::vector<std::int32_t> heights;  // the lines, five times as large, are computed when needed
    internal::TileLevelSet level_set;

    State(const Volumes& volumes, const VolumeTileKey& of_tile,
          std::span<const std::int32_t> samples)
        : key(of_tile),
          lattice(volumes.lattice()),
          level(volumes.level()),
          heights(samples.begin(), samples.end()),
          level_set(volumes.spacing()) {}

    internal::TileLines lines() const {
        return *internal::TileLines::create(lattice, level, key, heights);
    }
};

VolumeTile::VolumeTile(std::unique_ptr<State> state) : state_(std::move(state)) {}
VolumeTile::VolumeTile(VolumeTile&&) noexcept = default;
VolumeTile& VolumeTile::operator=(VolumeTile&&) noexcept = default;
VolumeTile::~VolumeTile() = default;

Result<VolumeTile> VolumeTile::create(const Volumes& volumes, const VolumeTileKey& key,
                                      std::span<const std::int32_t> heights) {
    TERRANE_TRY(const auto lines,
                internal::TileLines::create(volumes.lattice(), volumes.level(), key, heights));
    VolumeTile tile(std::make_unique<State>(volumes, key, heights));
    for (const std::uint32_t i : volumes.operations_at(key)) {
        const PlacedVolume& volume = volumes.operations()[i];
        tile.state_->level_set.apply(volume.op(), volume.shape(), lines);
    }
    return tile;
}

Result<VolumeTile> VolumeTile::decode(const Volumes& volumes, const VolumeTileKey& key,
                                      std::span<const std::int32_t> heights,
                                      std::span<const std::uint8_t> bytes) {
    TERRANE_TRY(internal::TileLines::create(volumes.lattice(), volumes.level(), key, heights));
    VolumeTile tile(std::make_unique<State>(volumes, key, heights));
    TERRANE_TRY(tile.state_->level_set.decode(bytes));
    return tile;
}

VolumeTile VolumeTile::copy() const { return VolumeTile(std::make_unique<State>(*state_)); }

std::vector<std::uint8_t> VolumeTile::encoded() const { return state_->level_set.encoded(); }

void VolumeTile::apply(const PlacedVolume& volume) {
    state_->level_set.apply(volume.op(), volume.shape(), state_->lines());
}

VolumeContour VolumeTile::contour(const std::array<bool, 4>& closes) const {
    return internal::contour_tile(state_->level_set, state_->lines(), state_->key, closes);
}

VolumeTile::NodeDistances VolumeTile::distances(int column, int row, std::int32_t k) const {
    TERRANE_ASSERT(
        column >= 0 && column < kVolumeTileSamples && row >= 0 && row < kVolumeTileSamples,
        "a line of the tile");
    const int line = internal::line_index(column, row);
    const auto metres = [&](Field field) {
        return static_cast<float>(state_->level_set.step() *
                                  state_->level_set.value(field, line, k));
    };
    return {metres(Field::to_void), metres(Field::to_solid)};
}

WorldPos VolumeTile::position(int column, int row, std::int32_t k) const {
    // As TileLines::position(), for one line.
    const State& state = *state_;
    const double spacing = state.lattice.level_spacing(state.level);
    const std::int64_t step = state.lattice.step(state.level);
    const auto line = static_cast<std::size_t>(internal::line_index(column, row));
    const double height = static_cast<double>(state.heights[line]) * state.lattice.quantum;
    const auto surface = static_cast<std::int32_t>(std::floor(height / spacing + 0.5));
    return {state.lattice.x((state.key.column * kVolumeTileCells + column) * step),
            state.lattice.y((state.key.row * kVolumeTileCells + row) * step),
            height + static_cast<double>(k - surface) * spacing};
}

std::span<const std::int32_t> VolumeTile::heights() const { return state_->heights; }

WorldPos VolumeTile::ground(int column, int row) const {
    const State& state = *state_;
    const std::int64_t step = state.lattice.step(state.level);
    const auto line = static_cast<std::size_t>(internal::line_index(column, row));
    return {state.lattice.x((state.key.column * kVolumeTileCells + column) * step),
            state.lattice.y((state.key.row * kVolumeTileCells + row) * step),
            static_cast<double>(state.heights[line]) * state.lattice.quantum};
}

const VolumeTileKey& VolumeTile::key() const { return state_->key; }
double VolumeTile::spacing() const { return state_->lattice.level_spacing(state_->level); }

std::size_t VolumeTile::bytes() const {
    return sizeof(State) + state_->heights.capacity() * sizeof(std::int32_t) +
           state_->level_set.bytes();
}
std::uint64_t VolumeTile::band_node_count() const { return state_->level_set.band_node_count(); }

}  // namespace terrane
