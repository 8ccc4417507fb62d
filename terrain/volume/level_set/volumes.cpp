// SPDX-License-Identifier: MIT
#include "level_set/placed_shape.h"
#include "level_set/shapes.h"
#include "level_set/tile_level_set.h"

#include <terrane/base/text.h>
#include <terrane/store/sealed_file.h>
#include <terrane/volume/volumes.h>

#include <algorithm>
#include <utility>

namespace terrane {
namespace {

using internal::PlacedShape;

constexpr std::size_t kMostTiles = std::size_t{1} << 22;

/// Tiles under a box, clipped to the world.
struct TileRange {
    VolumeTileKey first, last;
    double count() const {
        return last.column < first.column || last.row < first.row
                   ? 0.0
                   : static_cast<double>(last.column - first.column + 1) *
                         static_cast<double>(last.row - first.row + 1);
    }
};

TileRange tiles_under(const Lattice& lattice, int level, const Aabb& box) {
    const double spacing = lattice.level_spacing(level), side = spacing * kVolumeTileCells;
    const double reach = (internal::kBandSpacings + 1.0) * spacing;
    const std::int64_t tile_side = lattice.step(level) * kVolumeTileCells;
    const std::int64_t west = lattice.west() / tile_side, south = lattice.south() / tile_side;
    const std::int64_t east = lattice.east() / tile_side, north = lattice.north() / tile_side;
    // Clamped before the conversion, to one tile beyond the world on both sides.
    const auto tile_at = [&](double p, double origin, std::int64_t first, std::int64_t end) {
        const double at = std::floor((p - origin) / side);
        return static_cast<std::int64_t>(
            std::clamp(at, static_cast<double>(first - 1), static_cast<double>(end)));
    };
    TileRange range;
    range.first = {std::max(tile_at(box.low[0] - reach, lattice.origin_x, west, east), west),
                   std::max(tile_at(box.low[1] - reach, lattice.origin_y, south, north), south)};
    range.last = {
        std::min(tile_at(box.high[0] + reach, lattice.origin_x, west, east), east - 1),
        std::min(tile_at(box.high[1] + reach, lattice.origin_y, south, north), north - 1)};
    return range;
}

/// Extent along an axis, metres, of the part of a box inside one column or row of tiles.
double width_inside(const Aabb& box, int axis, double origin, std::int64_t index, double side) {
    const double begin = origin + static_cast<double>(index) * side;
    return std::max(0.0, std::min(box.high[axis], begin + side) - std::max(box.low[axis], begin));
}

/// The world's rectangle, widened by the band and one spacing.
Aabb world_of(const Lattice& lattice, int level) {
    const double reach = (internal::kBandSpacings + 1.0) * lattice.level_spacing(level);
    return {{lattice.x(lattice.west()) - reach, lattice.y(lattice.south()) - reach, 0.0},
            {lattice.x(lattice.east()) + reach, lattice.y(lattice.north()) + reach, 0.0}};
}

Result<PlacedShape> place(const Lattice& lattice, int level, const VolumeOperation& operation,
                          const VolumeSettings& settings) {
    const double spacing = lattice.level_spacing(level);
    const auto thin = [&](double thickness) {
        return fail(ErrorCode::invalid_argument, "the volume is " + number_text(thickness) +
                                                     " m thick, less than its voxel of " +
                                                     number_text(spacing) + " m");
    };
    Result<std::shared_ptr<const internal::SampledShape>> sampled = nullptr;
    if (const auto* mesh = std::get_if<VolumeMesh>(&operation.shape)) {
        Aabb box = internal::empty_box();
        for (const auto& triangle : mesh->triangles) {
            for (const std::uint32_t p : triangle) {
                internal::include(mesh->points_shape[p], 0.0, box);
            }
        }
        if (const double thickness = (box.high - box.low).minCoeff(); thickness < spacing)
            return thin(thickness);
        sampled =
            internal::SampledShape::of_mesh(*mesh, operation.world_from_shape, spacing, settings);
    } else if (const auto* file = std::get_if<VolumeFile>(&operation.shape)) {
        sampled =
            internal::SampledShape::of_file(*file, operation.world_from_shape, spacing, settings);
    } else {
        auto exact = internal::ExactShape::place(operation);
        if (const double thickness = exact.thickness(); thickness < spacing) return thin(thickness);
        return PlacedShape(std::move(exact));
    }
    if (!sampled) return tl::unexpected(sampled.error());
    return PlacedShape(*sampled);
}

Result<void> check_place(const Lattice& lattice, int level, const PlacedShape& shape) {
    const Aabb& box = shape.bounds();
    const double most = internal::kMostNode * lattice.level_spacing(level);
    if (!(box.low[2] > -most && box.high[2] < most)) {
        return fail(ErrorCode::invalid_argument,
                    "the volume reaches from " + number_text(box.low[2]) + " to " +
                        number_text(box.high[2]) + " m, beyond 2^28 voxels");
    }
    if (box.high[0] < lattice.x(lattice.west()) || box.low[0] > lattice.x(lattice.east()) ||
        box.high[1] < lattice.y(lattice.south()) || box.low[1] > lattice.y(lattice.north())) {
        return fail(ErrorCode::invalid_argument,
                    "the volume at (" + number_text(0.5 * (box.low[0] + box.high[0])) + ", " +
                        number_text(0.5 * (box.low[1] + box.high[1])) + ") is outside the world");
    }
    double tile_count = 0.0;
    shape.visit_part_bounds(world_of(lattice, level), [&](const Aabb& part) {
        tile_count += tiles_under(lattice, level, part).count();
        return tile_count <= static_cast<double>(kMostTiles);
    });
    if (tile_count <= static_cast<double>(kMostTiles)) return {};
    return fail(ErrorCode::invalid_argument,
                "the pieces of the volume touch more than 4194304 tiles of 32 voxels");
}

}  // namespace

Result<PlacedVolume> PlacedVolume::create(const Lattice& lattice, int level,
                                          const VolumeOperation& operation,
                                          const VolumeSettings& settings) {
    if (level < 0 || level > lattice.finest_level) {
        return fail(ErrorCode::invalid_argument, "level must be 0 to " +
                                                     number_text(lattice.finest_level) + ", got " +
                                                     number_text(level));
    }
    TERRANE_TRY(operation.validate());
    TERRANE_TRY(auto shape, place(lattice, level, operation, settings));
    TERRANE_TRY(check_place(lattice, level, shape));
    return PlacedVolume(operation.op, std::make_shared<const PlacedShape>(std::move(shape)),
                        lattice, level);
}

std::vector<VolumeTilePart> PlacedVolume::tiles() const {
    const double spacing = lattice_.level_spacing(level_), side = spacing * kVolumeTileCells;
    std::vector<VolumeTilePart> parts;
    shape_->visit_part_bounds(world_of(lattice_, level_), [&](const Aabb& part) {
        const TileRange range = tiles_under(lattice_, level_, part);
        const double height = part.high[2] - part.low[2];
        for (std::int64_t column = range.first.column; column <= range.last.column; ++column) {
            const double width = width_inside(part, 0, lattice_.origin_x, column, side);
            for (std::int64_t row = range.first.row; row <= range.last.row; ++row) {
                const double depth = width_inside(part, 1, lattice_.origin_y, row, side);
                parts.push_back({{column, row},
                                 {part.low[2], part.high[2]},
                                 2.0 * (width * depth + (width + depth) * height)});
            }
        }
        return true;
    });
    std::ranges::stable_sort(parts, {}, &VolumeTilePart::key);
    std::size_t count = 0;
    for (const VolumeTilePart& part : parts) {
        if (count > 0 && parts[count - 1].key == part.key) {
            VolumeTilePart& all = parts[count - 1];
            all.heights = {std::min(all.heights.low, part.heights.low),
                           std::max(all.heights.high, part.heights.high)};
            all.area += part.area;
        } else {
            parts[count++] = part;
        }
    }
    parts.resize(count);
    return parts;
}

const Aabb& PlacedVolume::bounds_world() const { return shape_->bounds(); }

std::size_t PlacedVolume::bytes() const { return shape_->bytes(); }

double PlacedVolume::signed_distance(const WorldPos& p_world) const {
    return shape_->signed_distance(p_world);
}

struct Volumes::State {
    Lattice lattice;
    int level = 0;
    std::vector<PlacedVolume> operations;
    std::array<std::uint64_t, 2> fingerprint{};
    std::vector<VolumeTileKey> tiles;    // sorted
    std::vector<std::uint32_t> begins;   // [tiles + 1] into indices and parts
    std::vector<std::uint32_t> indices;  // of operations, ascending within each tile
    std::vector<VolumeTilePart> parts;   // one for each index

    // First index and number of a tile's operations.
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
    TERRANE_TRY(lattice.validate());
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
    // All operations are checked first, because the level depends on all of them.
    double voxel = operations.empty() ? 1.0 : operations.front().voxel;
    for (std::size_t i = 0; i < operations.size(); ++i) {
        if (auto ok = operations[i].validate(); !ok) return named(i, ok.error());
        voxel = std::min(voxel, operations[i].voxel);
    }
    state->level = settings.level.value_or(pinned_level(lattice, voxel));
    struct Touch {
        VolumeTilePart part;
        std::uint32_t index = 0;  // index of the operation
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
