// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "culling/horizon_rows.h"

#include <terrane/scene/horizon_map.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/triangulator.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace terrane::internal {

/// Whether a point is above the drawn triangles at its x and y. False if no triangle is drawn there.
///
/// Cost: O(triangles of the chunks below the point)
bool is_above_drawn_ground(const TerrainMesh& mesh, const WorldPos& place);

namespace {

// Rounding margin: a triangle extends this far beyond its edges, relative to its area.
constexpr double kEdge = 1e-9;

double cross2(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

// lod_above.comp does the same on a device.
bool is_above_drawn_ground(const TerrainMesh& mesh, const WorldPos& place) {
    if (mesh.resident == nullptr) return false;
    const Lattice& lattice = mesh.resident->lattice();
    bool is_over_triangle = false;
    for (const MeshChunk& part : mesh.chunks) {
        const double spacing = lattice.spacing * static_cast<double>(part.chunk->step);
        const Eigen::Vector3d on_chunk(place.x() - lattice.x(part.chunk->corner.x),
                                       place.y() - lattice.y(part.chunk->corner.y), place.z());
        // wider than the margin of the triangles
        if (on_chunk.head<2>().minCoeff() < -spacing ||
            on_chunk.head<2>().maxCoeff() > (kChunkCells + 1) * spacing)
            continue;
        const auto corner = [&](std::size_t sample) -> Eigen::Vector3d {
            const std::size_t column = sample % kChunkSamples, row = sample / kChunkSamples;
            return Eigen::Vector3d(static_cast<double>(column) * spacing,
                                   static_cast<double>(row) * spacing,
                                   part.displayed_height(sample, lattice.quantum)) -
                   on_chunk;
        };
        for (std::size_t i = 0; i < part.index_count; i += 3) {
            const auto samples = mesh.indices.subspan(part.first_index + i, 3);
            const Eigen::Vector3d a = corner(samples[0]), b = corner(samples[1]),
                                  c = corner(samples[2]);
            // twice the areas of the triangles of the place and an edge
            const double of_a = cross2(b, c), of_b = cross2(c, a), of_c = cross2(a, b);
            const double area = of_a + of_b + of_c;
            if (!(std::min({of_a, of_b, of_c}) >= -kEdge * area)) continue;
            if (!(of_a * a.z() + of_b * b.z() + of_c * c.z() < 0.0)) return false;
            is_over_triangle = true;
        }
    }
    return is_over_triangle;
}

}  // namespace terrane::internal

// Proof that the ground hides objects below the horizon. A slope is a rise over a horizontal distance from the eye. At
// distance d from the eye the drawn ground is at most e d + f below the true surface (TerrainMesh), where e is
// GroundError::refinable_px over pixels per radian, and f is finest_m. The horizon is computed for the lowered surface:
// the true surface, lowered by f / (1 - e).
//
//   1. Let t be the slope of a ray whose azimuth is in a sector with horizon U, where U - e sqrt(1 + U^2) > t. Along
//      this azimuth the slope of the lowered surface goes from -infinity below the eye to at least U, continuously,
//      because there is ground everywhere.
//   2. Hence that slope somewhere has the value u between t and U with u - e sqrt(1 + u^2) = t. There the lowered
//      surface is above the ray by e sqrt(1 + u^2) times the horizontal distance, which is e times its distance from
//      the eye.
//   3. The point of the true surface above it is farther from the eye by at most f / (1 - e). If that point is in view,
//      the drawn ground is at most e d + e f / (1 - e) + f = e d + f / (1 - e) below it, where d is the distance of the
//      lowered point: so the drawn ground is not below the ray. Distances are not below near_distance, because the true
//      surface is farther than that from the eye.
//   4. The ray starts above the drawn ground and is not above it at the point in 3: it has met the drawn ground before
//      the object. It has also met the true surface, which is below the eye, and above the ray at the point in 3.
//
// For "in view" in 3 the object, raised by the height of the true point above the ray, must be within the planes of the
// view that face down.

namespace terrane {
namespace {

using internal::azimuth_of;
using internal::HorizonRows;
using internal::kSectors;
using internal::ring_of;
using internal::SectorRange;
using internal::Wedge;

// Margin for rounding to float on the GPU.
constexpr double kMargin_px = 1.0;
// No map is built if the refinable error, as an angle, is larger than this, radians.
constexpr double kMostError = 0.25;
// Least horizontal component of a unit direction whose azimuth is reliable.
constexpr double kLeastHorizontal = 1e-6;
// Largest side, in cells, of the square below the eye whose errors are read.
constexpr double kMostCells = 64.0;

double cross2(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
}

// The sectors that a view shows: all if it shows the nadir or the zenith.
SectorRange sectors_of(const View& view, const Frustum& frustum) {
    bool shows_nadir = true, shows_zenith = true;
    for (const Eigen::Vector3d& normal : frustum.normals) {
        shows_nadir = shows_nadir && normal.z() <= kLeastHorizontal;
        shows_zenith = shows_zenith && normal.z() >= -kLeastHorizontal;
    }
    if (shows_nadir || shows_zenith) return SectorRange::all();
    // the horizontal projection of the view's cone is convex, so its extreme directions are those of corners
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d direction = direction_through(
            view, (i & 1) != 0 ? view.width_px : 0.0, (i & 2) != 0 ? view.height_px : 0.0);
        corners[i] = {direction.x(), direction.y()};
        if (!(corners[i].squaredNorm() > kLeastHorizontal * kLeastHorizontal))
            return SectorRange::all();
    }
    Wedge wedge{corners[0], corners[0]};
    for (const Eigen::Vector2d& corner : corners) {
        if (cross2(corner, wedge.right) > 0.0) wedge.right = corner;
        if (cross2(wedge.left, corner) > 0.0) wedge.left = corner;
    }
    for (const Eigen::Vector2d& corner : corners) {
        if (cross2(wedge.right, corner) < 0.0 || cross2(corner, wedge.left) < 0.0)
            return SectorRange::all();  // rounding, at nearly half a turn
    }
    return wedge.touched();
}

// Cells of a level within a distance of a position along both axes.
CellRange cells_around(const Ground& ground, const WorldPos& eye, double reach) {
    return {ground.column_at(eye.x() - reach), ground.row_at(eye.y() - reach),
            ground.column_at(eye.x() + reach), ground.row_at(eye.y() + reach)};
}

// The finest level at which all cells around a position are resident ground, with at most kMostCells along a side.
std::optional<int> level_around(const std::shared_ptr<const ResidentSet>& resident,
                                const WorldPos& eye, double reach) {
    for (int level = resident->lattice().finest_level; level >= 0; --level) {
        const Ground ground(resident, level);
        if (2.0 * reach > kMostCells * ground.spacing()) continue;
        if (GroundReader(ground).is_all_ground(cells_around(ground, eye, reach))) return level;
    }
    return std::nullopt;
}

// Whether the true surface within a horizontal distance of the eye is lower than the eye by more than that distance.
bool is_above_ground(const std::shared_ptr<const ResidentSet>& resident, const WorldPos& eye,
                     double distance) {
    const std::optional<int> level = level_around(resident, eye, distance);
    if (!level) return false;
    const Ground ground(resident, *level);
    const CellRange cells = cells_around(ground, eye, distance);
    GroundReader reader(ground);
    // squares at least as wide as the distance, so that at most three lie along a side
    int log2_side = 0;
    while (log2_side < 7 && static_cast<double>(1 << log2_side) * ground.spacing() < distance)
        ++log2_side;
    const std::int64_t side = std::int64_t{1} << log2_side;
    double highest = -std::numeric_limits<double>::infinity();
    for (std::int64_t row = cells.south & -side; row <= cells.north; row += side) {
        for (std::int64_t column = cells.west & -side; column <= cells.east; column += side) {
            const RangeAnswer range = reader.square(column, row, log2_side);
            highest = std::max(highest, ground.lattice().quantum * range.high);
        }
    }
    return highest + static_cast<double>(reader.error(cells)) < eye.z() - distance;
}

// A bounding volume relative to the eye, as needed by the tests.
struct Occludee {
    Eigen::Vector3d centre;
    double radius = 0.0;  // of its horizontal disc
    double low = 0.0, high = 0.0;
};

Occludee occludee_of(const Aabb& box_world, const WorldPos& eye_world) {
    const Eigen::Vector3d low = box_world.low - eye_world, high = box_world.high - eye_world;
    const Eigen::Vector2d half(0.5 * (high.x() - low.x()), 0.5 * (high.y() - low.y()));
    return {0.5 * (low + high), half.norm(), low.z(), high.z()};
}

// The directions to a disc. sine: of half the angle that it subtends, below 1
Wedge wedge_of(const Eigen::Vector2d& centre, double sine) {
    const double cosine = std::sqrt(1.0 - sine * sine);
    const Eigen::Vector2d across(-centre.y(), centre.x());
    return {cosine * centre - sine * across, cosine * centre + sine * across};
}

}  // namespace

struct HorizonMap::State {
    bool is_clear = true;
    View view;
    Frustum frustum;
    GroundError largest;
    double error = 0.0;  // radians
    double depth = 0.0;  // of the lowered surface below the true one, metres
    HorizonRows rows;

    template <class Reach>
    bool hides(const Occludee& object, const Reach& reach) const;
};

// reach(normal): how far the object extends from its centre along a normal.
template <class Reach>
bool HorizonMap::State::hides(const Occludee& object, const Reach& reach) const {
    const Eigen::Vector2d centre(object.centre.x(), object.centre.y());
    const double distance = centre.norm();
    const double nearest = distance - object.radius, farthest = distance + object.radius;
    if (!(nearest > 0.0) || !std::isfinite(farthest) || !std::isfinite(object.centre.z()))
        return false;
    const int ring = ring_of(nearest) - 1;
    if (ring < 0) return false;
    const double most_slope = object.high / (object.high >= 0.0 ? nearest : farthest);
    const double least_slope = object.low / (object.low >= 0.0 ? farthest : nearest);

    // early exit: most objects are above the horizon in the sector of their centre
    const HorizonRows::Row& row = rows.row(ring);
    const auto middle = static_cast<std::size_t>(azimuth_of(centre.x(), centre.y())) % kSectors;
    if (!(static_cast<double>(row[middle]) > most_slope)) return false;
    float lowest = std::numeric_limits<float>::max();
    wedge_of(centre, object.radius / distance).touched().visit([&](std::size_t sector) {
        lowest = std::min(lowest, row[sector]);
    });
    const auto horizon = static_cast<double>(lowest);
    if (!(horizon - error * std::sqrt(1.0 + horizon * horizon) > most_slope)) return false;

    const double steepest = std::max(std::abs(least_slope), std::abs(horizon));
    const double raise = error * std::sqrt(1.0 + steepest * steepest) * farthest + depth;
    for (const Eigen::Vector3d& normal : frustum.normals) {
        if (normal.z() >= 0.0) continue;
        if (!(internal::dot(normal, object.centre) - reach(normal) + normal.z() * raise >= 0.0))
            return false;
    }
    return true;
}

HorizonMap::HorizonMap() : state_(std::make_unique<State>()) {}
HorizonMap::HorizonMap(HorizonMap&&) noexcept = default;
HorizonMap& HorizonMap::operator=(HorizonMap&&) noexcept = default;
HorizonMap::~HorizonMap() = default;

void HorizonMap::clear() { state_->is_clear = true; }

void HorizonMap::build(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                       const GroundError& largest) {
    State& state = *state_;
    state.is_clear = true;
    if (resident == nullptr || !view.validate()) return;
    if (!(largest.refinable_px >= 0.0) || !(largest.finest_m >= 0.0)) return;
    state.largest = largest;
    state.error = (largest.refinable_px + kMargin_px) / view.pixels_per_radian();
    if (!(state.error < kMostError) || !std::isfinite(largest.finest_m) || !resident->has_roots())
        return;
    state.depth = largest.finest_m / (1.0 - state.error);
    for (const ResidentChunk& chunk : resident->chunks()) {
        if (chunk->key.level > 0) break;
        if (!chunk->is_certified) return;
    }
    const WorldPos& eye = view.eye_world;
    if (!resident->extent().contains(eye.x(), eye.y()) ||
        !is_above_ground(resident, eye, view.near_distance))
        return;
    state.view = view;
    state.frustum = make_frustum(view);
    // raising the eye is equivalent to lowering the surface
    state.rows.build(*resident, eye + Eigen::Vector3d(0.0, 0.0, state.depth),
                     sectors_of(view, state.frustum));
    state.is_clear = false;
}

bool HorizonMap::holds_for(const TerrainMesh& mesh, std::optional<bool> is_eye_above) const {
    const State& state = *state_;
    if (state.is_clear) return true;
    if (!(mesh.refinable_error_px <= state.largest.refinable_px &&
          mesh.finest_error_m <= state.largest.finest_m))
        return false;
    return is_eye_above ? *is_eye_above
                        : internal::is_above_drawn_ground(mesh, state.view.eye_world);
}

bool HorizonMap::is_of(const View& view) const {
    const State& state = *state_;
    const View& own = state.view;
    return !state.is_clear && own.eye_world == view.eye_world && own.forward == view.forward &&
           own.up == view.up && own.vertical_fov == view.vertical_fov &&
           own.width_px == view.width_px && own.height_px == view.height_px &&
           own.near_distance == view.near_distance;
}

bool HorizonMap::hides(const BoundingSphere& sphere_world) const {
    const State& state = *state_;
    if (state.is_clear) return false;
    const Eigen::Vector3d centre = sphere_world.centre - state.view.eye_world;
    const double radius = sphere_world.radius;
    return state.hides({centre, radius, centre.z() - radius, centre.z() + radius},
                       [&](const Eigen::Vector3d&) { return radius; });
}

bool HorizonMap::hides(const Aabb& box_world) const {
    const State& state = *state_;
    if (state.is_clear) return false;
    const Eigen::Vector3d half = 0.5 * (box_world.high - box_world.low);
    return state.hides(
        occludee_of(box_world, state.view.eye_world),
        [&](const Eigen::Vector3d& normal) { return internal::reach_along(normal, half); });
}

// An object is hidden only if the horizon in the sector of its centre is above the slope of its highest point. The rows
// grow with the distance, and no highest point is below the box.
bool HorizonMap::may_hide_in(const Aabb& box_world) const {
    const State& state = *state_;
    if (state.is_clear) return false;
    const Occludee box = occludee_of(box_world, state.view.eye_world);
    const Eigen::Vector2d centre(box.centre.x(), box.centre.y());
    const double distance = centre.norm();
    const double nearest = distance - box.radius, farthest = distance + box.radius;
    if (!(nearest > 0.0) || !std::isfinite(farthest)) return true;
    const int ring = ring_of(farthest) - 1;
    if (ring < 0) return false;
    const double slope = box.low / (box.low >= 0.0 ? farthest : nearest);
    const HorizonRows::Row& row = state.rows.row(ring);
    bool is_above = false;
    wedge_of(centre, box.radius / distance).touched().visit([&](std::size_t sector) {
        is_above = is_above || static_cast<double>(row[sector]) > slope;
    });
    return is_above;
}

}  // namespace terrane
