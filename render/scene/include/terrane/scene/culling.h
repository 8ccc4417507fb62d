// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// An oriented bounding box, closed.
struct OrientedBox {
    Pose frame_from_box;  ///< its origin is the centre of the box
    Eigen::Vector3d half_extents = Eigen::Vector3d::Zero();  ///< along the box's axes, metres, >= 0
};

/// The smallest axis-aligned box around points; low = high = 0 without points.
Aabb bounding_box(std::span<const Eigen::Vector3d> points);

/// Transforms a box to another frame. The result has the transformed axes, so that no volume is added.
OrientedBox transform(const Pose& target_from_source, double scale, const Aabb& box_source);

/// The smallest axis-aligned box around an oriented box, rounded outward.
Aabb bounding_box(const OrientedBox& box);

/// The circumscribed sphere of a box, rounded outward.
BoundingSphere bounding_sphere(const OrientedBox& box);

/// Relation of an object to a view volume.
enum class Containment : std::uint8_t {
    outside,       ///< no point of the object is in the volume
    intersecting,  ///< not known to be outside or inside
    inside,        ///< the object is entirely in the volume
};

/// State of ViewVolume::test_planes(): the planes that must still be tested, because no enclosing bounding volume is
/// entirely inside them, and the plane to test first.
struct PlaneState {
    static constexpr std::uint8_t kAll = 0b11111;  ///< mask of all planes
    static constexpr std::uint8_t kFarPlane = 4;   ///< number of the far plane
    /// Bit i: the object is not yet known to be entirely inside plane i.
    std::uint8_t mask = kAll;
    std::uint8_t first = 0;  ///< plane to test first: the one that last excluded the object, 0 to 4
};

/// The set of points that a view can show: the infinite pyramid of its four side planes, cut by an optional far plane.
/// Closed and convex, with its apex at the eye.
///
/// There are three tests, each more exact and more expensive than the one before:
///   1. test_planes() tests one plane at a time. It accepts some objects that are outside near an edge of the volume.
///   2. meets() tests a bounding volume exactly; boxes by separating axes.
///   3. meets_triangles() tests the triangles themselves.
/// No test rejects an object in the volume: comparisons have a rounding margin of 1e-14 of the distance from the eye.
///
/// Sources: U. Assarsson, T. Moller. Optimized View Frustum Culling Algorithms for Bounding Boxes. Journal of Graphics
///          Tools 5(1), 2000 (plane masks; the plane that last excluded an object is tested first).
///          S. Gottschalk, M. Lin, D. Manocha. OBBTree. SIGGRAPH 1996 (separating axes).
///
/// Threads: any number at once
class ViewVolume {
public:
    /// Requires a view that validate() accepts and far_distance > 0.
    ///
    /// @param far_distance distance of the far plane along the view's direction, metres; infinity: no far plane
    explicit ViewVolume(const View& view,
                        double far_distance = std::numeric_limits<double>::infinity());

    /// The apex.
    const WorldPos& eye_world() const { return eye_; }
    /// Inward unit normals of the planes: left, right, bottom, top, and far if there is a far plane.
    std::span<const Eigen::Vector3d> normals() const {
        return std::span(normals_).first(static_cast<std::size_t>(plane_count_));
    }
    /// Corners of the far plane relative to the eye, in order around the picture; 0 if there is no far plane.
    const std::array<Eigen::Vector3d, 4>& far_corners() const { return far_corners_; }

    /// Tests the planes of state.mask, beginning with state.first. On `outside`, state.first becomes the plane that
    /// excludes the object; otherwise the planes that the object is entirely inside of are removed from state.mask.
    Containment test_planes(const BoundingSphere& sphere_world, PlaneState& state) const;
    Containment test_planes(const Aabb& box_world, PlaneState& state) const;
    Containment test_planes(const OrientedBox& box_world, PlaneState& state) const;

    /// Whether the volume and a bounding volume have a common point; exact up to the margin.
    bool meets(const BoundingSphere& sphere_world) const;
    bool meets(const Aabb& box_world) const;
    bool meets(const OrientedBox& box_world) const;

    /// Whether any triangle has a point in the volume; exact up to the margin.
    /// Requires indices below the count of positions.
    ///
    /// Cost:  linear in the number of triangles up to the first one that has a point in the volume
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
    std::array<Eigen::Vector3d, 2> sides_;  // unit, along the sides of the far rectangle
    std::array<Eigen::Vector3d, 4> far_corners_;
};

/// Direction of the sun, and range of the shadows that a renderer draws. Scenes use it to find the casters out of view.
struct SunShadows {
    /// Towards the sun, finite and not zero; of any length.
    Eigen::Vector3d sun_direction = Eigen::Vector3d::UnitZ();
    /// Distance from the eye within which shadows are drawn, metres; 0: no shadows.
    double distance = 0.0;
};

/// Whether the direction is valid and the distance is above 0 and at most 1e9 m.
bool has_shadows(const SunShadows& shadows);

/// The set of points from which an object can cast a shadow into a view: the view volume up to the shadow distance (a
/// far plane), extruded to infinity towards the sun.
///
/// The set is bounded by the planes of the view that the extrusion does not cross, and by planes that contain an edge
/// of the view and the sun's direction. The tests are conservative: they accept every bounding volume that meets the
/// set, and some near its edges that do not. Comparisons have a rounding margin of 1e-11 of the distance from the eye.
///
/// Threads: any number at once
class CasterVolume {
public:
    /// Requires a view that validate() accepts, and has_shadows(shadows).
    CasterVolume(const View& view, const SunShadows& shadows);

    /// Whether a sphere has a point in the set.
    bool meets(const BoundingSphere& sphere_world) const;
    /// Whether an axis-aligned box has a point in the set.
    bool meets(const Aabb& box_world) const;
    /// Whether an oriented box has a point in the set.
    bool meets(const OrientedBox& box_world) const;

private:
    // The half-space of the points p with normal.dot(p - eye) >= least.
    struct Plane {
        Eigen::Vector3d normal;  // unit
        double least;
    };
    static constexpr std::size_t kMostPlanes = 13;  // 5 faces and 8 edges of the view

    void add(const Eigen::Vector3d& normal, double least);
    template <class Extent>
    bool meets(const Eigen::Vector3d& centre_eye, double size, const Extent& extent) const;

    WorldPos eye_;
    double size_ = 0.0;  // of the view up to the shadow distance, metres
    std::array<Plane, kMostPlanes> planes_;
    std::size_t plane_count_ = 0;
};

/// Test of bounding boxes against the view volume.
enum class CullTest : std::uint8_t {
    planes,  ///< one plane at a time: accepts some boxes that are outside near an edge of the volume
    exact,   ///< separating axes if the planes do not decide
};

/// Cache of one viewer for CullTree::cull(): the plane that last excluded each node. Affects only the cost.
struct CullMemory {
    std::vector<std::uint8_t> last_plane;  ///< [nodes]; resized by cull()
};

/// Frustum culling of many boxes by a bounding volume hierarchy: a node that is outside excludes its subtree, a node
/// that is inside includes it, and planes that a node is inside of are not tested below it.
///
/// Threads: any number of cull() at once, each with its own memory
class CullTree {
public:
    /// @param boxes_world [objects] finite, low <= high; at most 2^31
    ///
    /// Cost: O(n log n), about 0.2 microseconds an object
    explicit CullTree(std::span<const Aabb> boxes_world);
    CullTree(CullTree&&) noexcept;
    CullTree& operator=(CullTree&&) noexcept;
    ~CullTree();

    /// Number of objects.
    std::size_t size() const;

    /// Updates the boxes and keeps the hierarchy. The farther the objects have moved relative to each other, the more
    /// expensive culling becomes.
    ///
    /// @param boxes_world [size()]
    void refit(std::span<const Aabb> boxes_world);

    /// Replaces visible_out by the indices of the objects whose boxes, and whose ancestors' boxes, are not outside:
    /// each once, in an order that depends only on the constructor's boxes.
    ///
    /// Allocates: nothing once the outputs are large enough
    void cull(const ViewVolume& volume, CullTest test, CullMemory& memory,
              std::vector<std::uint32_t>& visible_out) const;

    /// Replaces casters_out by the indices of the objects whose boxes, and whose ancestors' boxes, meet the volume, in
    /// the same order.
    ///
    /// Allocates: nothing once the output is large enough
    void find_casters(const CasterVolume& volume, std::vector<std::uint32_t>& casters_out) const;

private:
    struct Nodes;
    std::unique_ptr<Nodes> nodes_;
};

}  // namespace terrane
