// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/bounds.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>

namespace terrane {

/// Relation of an object to a view volume.
enum class Containment : std::uint8_t {
    outside,       ///< no point of it is in the volume
    intersecting,  ///< not known to be outside or inside
    inside,        ///< all of it is in the volume
};

/// Planes left to test, inherited from enclosing bounding volumes, and the plane to begin with.
struct PlaneState {
    static constexpr std::uint8_t kAll = 0b11111;  ///< mask of all planes
    static constexpr std::uint8_t kFarPlane = 4;   ///< number of the far plane
    /// Bit i: plane i is not yet known to have all of it on its inner side.
    std::uint8_t mask = kAll;
    std::uint8_t first = 0;  ///< plane that is tested first: the one that excluded it last, 0 to 4
};

/// The set of points that a view can show: the infinite pyramid of its four side planes, cut by a far plane where
/// there is one. Closed and convex, with its apex at the eye.
///
/// Tests are in three steps, each more exact and more expensive; the answers of all are valid:
///   1. test_planes(): one plane at a time. Keeps some that are outside near edges of the volume.
///   2. meets(): the exact test of a bounding volume, separating axes for boxes.
///   3. meets_triangles(): the triangles themselves.
/// None drops what is in the volume: comparisons have a margin for rounding, of 1e-14 of the distance from the eye.
///
/// Sources: U. Assarsson, T. Moller. Optimized View Frustum Culling Algorithms for Bounding Boxes. Journal of Graphics
/// Tools 5(1), 2000 (plane masks, the last plane first). S. Gottschalk, M. Lin, D. Manocha. OBBTree. SIGGRAPH 1996
/// (separating axes).
///
/// Threads: any number at once
class ViewVolume {
public:
    /// Requires a view that check() accepts and far_distance > 0.
    ///
    /// @param far_distance of the far plane along the view's direction, metres; infinity: none
    explicit ViewVolume(const View& view,
                        double far_distance = std::numeric_limits<double>::infinity());

    /// The apex.
    const WorldPos& eye_world() const { return eye_; }
    /// Inward unit normals of its planes: left, right, bottom, top, and far where there is a far plane.
    std::span<const Eigen::Vector3d> normals() const {
        return std::span(normals_).first(static_cast<std::size_t>(plane_count_));
    }
    /// Corners of the far plane relative to the eye, in order around the picture; 0 where there is none.
    const std::array<Eigen::Vector3d, 4>& far_corners() const { return far_corners_; }

    /// Tests the planes of state.mask, state.first first. `outside`: state.first is set to the plane that excludes it.
    /// Else the planes that have all of it on their inner side are removed from state.mask.
    Containment test_planes(const BoundingSphere& ball_world, PlaneState& state) const;
    Containment test_planes(const Aabb& box_world, PlaneState& state) const;
    Containment test_planes(const OrientedBox& box_world, PlaneState& state) const;

    /// Whether the volume and a bounding volume have a common point, exactly up to the margin.
    bool meets(const BoundingSphere& ball_world) const;
    bool meets(const Aabb& box_world) const;
    bool meets(const OrientedBox& box_world) const;

    /// Whether any triangle has a point in the volume, exactly up to the margin.
    /// Requires indices below the count of positions.
    ///
    /// Cost: linear in the triangles until one is found
    bool meets_triangles(const Pose& world_from_object, double scale,
                         std::span<const Eigen::Vector3d> positions,
                         std::span<const TriangleMesh::Triangle> triangles) const;

private:
    struct LocalBox;  // centre relative to the eye, axes, half extents
    // Signed distance of a point from a plane, inward positive; p relative to the eye.
    double inward(int plane, const Eigen::Vector3d& p) const;
    template <class Extent>
    Containment test(const Eigen::Vector3d& centre_eye, double size, const Extent& extent,
                     PlaneState& state) const;
    bool meets(const LocalBox& box) const;
    bool is_separated(const LocalBox& box, const Eigen::Vector3d& axis) const;
    double squared_distance(const Eigen::Vector3d& p_eye) const;
    bool is_inside_but(int plane, const Eigen::Vector3d& p_eye) const;
    bool meets_triangle(const std::array<Eigen::Vector3d, 3>& corners_eye) const;

    WorldPos eye_;
    int plane_count_ = 4;
    double far_ = 0.0;
    std::array<Eigen::Vector3d, 5> normals_;  // inward, unit: left, right, bottom, top, far
    std::array<Eigen::Vector3d, 4>
        edges_;  // unit, from the eye: corners of the picture in order around it
    std::array<Eigen::Vector3d, 2> sides_;  // unit, of the far rectangle
    std::array<Eigen::Vector3d, 4> far_corners_;
};

}  // namespace terrane
