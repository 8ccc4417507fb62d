// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::test {

/// A view from near a place, with any direction, roll, field of view from 1 to 170 degrees and shape of picture.
View random_view(Random& random, const WorldPos& near_world);

/// Whether a point is between a view's side planes, and at most so far along its direction.
bool is_shown(const View& view, const WorldPos& p_world,
              double far_distance = std::numeric_limits<double>::infinity());

/// A point of a ball's surface that the view shows, more often of its upper half; none where a random one is not shown.
std::optional<WorldPos> shown_point(Random& random, const View& view, const BoundingSphere& ball);

/// A unit vector square to a unit vector, spread evenly.
Eigen::Vector3d any_perpendicular(const Eigen::Vector3d& direction, Random& random);

/// A box with any rotation and extents from 0 to about `size`.
OrientedBox random_box(Random& random, const WorldPos& centre_world, double size);

/// A closed convex set, by the nearest point of it to a point.
using Projection = std::function<Eigen::Vector3d(const Eigen::Vector3d& p)>;

Projection project_to_box(const OrientedBox& box);
Projection project_to_ball(const BoundingSphere& ball);
Projection project_to_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c);
/// The points of a view, by its make_frustum() and a far distance: Dykstra's algorithm over its half-spaces
/// (J. Boyle, R. Dykstra, 1986).
Projection project_to_view(const View& view, double far_distance);

/// How far apart two sets are.
enum class Apart { no, yes, unknown };

/// Alternating projections (W. Cheney, A. Goldstein, 1959). `no`: points of both within 1e-9 were found. `yes`: the
/// distance is above 1e-5 and has converged, so that it does not go to 0. `unknown`: neither.
Apart are_apart(const Projection& a, const Projection& b, const Eigen::Vector3d& start);

/// All chunks of a source down to a level.
///
/// @param is_resident of a chunk whose parent is resident; none: all are
/// @param change      replaces a chunk; none: none is
std::shared_ptr<const ResidentSet> resident_chunks(
    const HeightSource& source, int finest_level,
    const std::function<bool(const ChunkKey&)>& is_resident = {},
    const std::function<std::shared_ptr<const Chunk>(std::shared_ptr<const Chunk>)>& change = {});

/// The triangles of a frame as they are drawn, for rays.
MeshRays drawn_surface(const TerrainMesh& mesh);

/// A view that looks along a horizontal direction, raised by a slope, and rolled by an angle.
View view_along(const WorldPos& eye_world, const Eigen::Vector2d& direction, double slope,
                double roll);

/// A rock with continuous levels of detail, and discrete ones at errors of 0.2, 0.5 and 1.5 % of its size.
struct RockLevels {
    ObjectModel model;
    std::vector<std::vector<TriangleMesh::Triangle>> triangles;  ///< [levels that are meshes]
};

/// @param depth        20 * 4^depth triangles
/// @param has_impostor after the meshes
/// @param morphs       the meshes morph into each other
RockLevels make_rock_levels(int depth, std::uint64_t seed, bool has_impostor = true,
                            bool morphs = true);

/// By hand: pixels per metre of error at scale 1.
double factor_of(const View& view, const ObjectModel& model, const PlacedObject& object);

/// The number of the object that an instance places: the one within a centimetre. That of all objects if there is none.
std::size_t object_of(const ObjectInstance& instance, const View& view,
                      std::span<const PlacedObject> objects);
Eigen::Quaterniond rotation_of(const PlacedObject& object);

/// Bits of a frame's draws, without casters and particles.
std::vector<std::byte> bits_of(const SceneDraws& draws);
bool are_equal(std::span<const TriangleDemand> a, std::span<const TriangleDemand> b);

/// Any threshold from 2^low to 2^high, or the end of a demand's bin, where it is just granted or just not.
double random_threshold(Random& random, std::span<const TriangleDemand> demands, double low,
                        double high);

/// Triangles that demands grant at a threshold.
std::size_t granted(std::span<const TriangleDemand> demands, double threshold_px);

}  // namespace terrane::test
