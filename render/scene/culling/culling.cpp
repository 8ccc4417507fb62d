// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "base/vector_math.h"

#include <terrane/base/result.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane {
namespace {

// Bound of the relative rounding error of a sum of a few products.
constexpr double kRounding = 0x1p-49;

}  // namespace

Aabb bounding_box(std::span<const Eigen::Vector3d> points) {
    if (points.empty()) return {};
    Aabb box = {points[0], points[0]};
    for (const Eigen::Vector3d& p : points) {
        box.low = box.low.cwiseMin(p);
        box.high = box.high.cwiseMax(p);
    }
    return box;
}

OrientedBox transform(const Pose& target_from_source, double scale, const Aabb& box_source) {
    const Eigen::Vector3d middle = 0.5 * (box_source.low + box_source.high);
    // The larger distance from the computed middle to an end covers the rounding of the middle.
    const Eigen::Vector3d half =
        (box_source.high - middle).cwiseMax(middle - box_source.low) * (1.0 + kRounding);
    OrientedBox box;
    box.frame_from_box = {target_from_source.rotation,
                          target_from_source * Eigen::Vector3d(scale * middle)};
    box.half_extents = scale * half;
    return box;
}

Aabb bounding_box(const OrientedBox& box) {
    const Pose& pose = box.frame_from_box;
    const Eigen::Vector3d reach = pose.rotation.cwiseAbs() * box.half_extents;
    const Eigen::Vector3d outward = reach + kRounding * (reach + pose.translation.cwiseAbs());
    return {pose.translation - outward, pose.translation + outward};
}

BoundingSphere bounding_sphere(const OrientedBox& box) {
    return {box.frame_from_box.translation, box.half_extents.norm() * (1.0 + kRounding)};
}

// Deviation from the sources: the volume is a pyramid without a near plane, and infinite if it has no far plane. It is
// tested like any convex polyhedron: the candidate separating axes are the face normals of volume and box, and the
// cross products of their edges (the facets of the Minkowski difference).

namespace {

using internal::cross;
using internal::dot;
using internal::length;
using internal::norm1;
using internal::reach_along;
using internal::rotated;

// Tolerance of comparisons, relative to the sum of the distance from the eye, the size of the bounding volume and the
// far distance. Rounding errors are below 2^-50 of this sum.
constexpr double kViewMargin = 1e-14;
constexpr int kFarPlane = PlaneState::kFarPlane;

}  // namespace

// A box relative to the eye.
struct ViewVolume::LocalBox {
    Eigen::Vector3d centre;
    std::array<Eigen::Vector3d, 3> axes;
    Eigen::Vector3d half_extents;

    double reach(const Eigen::Vector3d& axis) const {
        return std::abs(dot(axis, axes[0])) * half_extents[0] +
               std::abs(dot(axis, axes[1])) * half_extents[1] +
               std::abs(dot(axis, axes[2])) * half_extents[2];
    }
    double size() const { return norm1(half_extents); }
};

ViewVolume::ViewVolume(const View& view, double far_distance) : eye_(view.eye_world) {
    TERRANE_ASSERT(view.validate().has_value(), "the view must be valid");
    TERRANE_ASSERT(far_distance > 0.0, "far_distance must be > 0");
    const Frustum frustum = make_frustum(view);
    for (std::size_t i = 0; i < 4; ++i) normals_[i] = frustum.normals[i];
    normals_[kFarPlane] = -view.forward;
    if (std::isfinite(far_distance)) {
        plane_count_ = 5;
        far_ = far_distance;
    }
    // Pairs of planes, in order around the picture: left and bottom, bottom and right, right and top, top and left.
    const std::array<std::array<std::size_t, 2>, 4> pairs = {{{0, 2}, {2, 1}, {1, 3}, {3, 0}}};
    for (std::size_t i = 0; i < 4; ++i) {
        Eigen::Vector3d edge = cross(normals_[pairs[i][0]], normals_[pairs[i][1]]);
        if (dot(edge, view.forward) < 0.0) edge = -edge;
        edges_[i] = edge / length(edge);
        far_corners_[i] = edges_[i] * (far_ / dot(edges_[i], view.forward));
    }
    sides_ = {view.right(), view.up};
}

double ViewVolume::inward(int plane, const Eigen::Vector3d& p) const {
    const double along = dot(normals_[static_cast<std::size_t>(plane)], p);
    return plane == kFarPlane ? along + far_ : along;
}

// extent(normal): how far the bounding volume extends from its centre along a normal.
template <class Extent>
Containment ViewVolume::test(const Eigen::Vector3d& centre_eye, double size, const Extent& extent,
                             PlaneState& state) const {
    const double margin =
        kViewMargin * (norm1(centre_eye) + size + (plane_count_ > kFarPlane ? far_ : 0.0));
    std::uint32_t left = state.mask & ((1u << plane_count_) - 1u);
    std::uint32_t crossed = 0;
    for (int plane = state.first; left != 0;) {
        const std::uint32_t bit = 1u << plane;
        if ((left & bit) != 0) {
            left &= ~bit;
            const double at = inward(plane, centre_eye);
            const double reach = extent(normals_[static_cast<std::size_t>(plane)]) + margin;
            if (!(at >= -reach)) {
                if (std::isnan(at)) return Containment::intersecting;
                state.first = static_cast<std::uint8_t>(plane);
                return Containment::outside;
            }
            if (!(at >= reach)) crossed |= bit;
        }
        plane = plane + 1 < plane_count_ ? plane + 1 : 0;
    }
    state.mask = static_cast<std::uint8_t>(crossed);
    return crossed == 0 ? Containment::inside : Containment::intersecting;
}

Containment ViewVolume::test_planes(const BoundingSphere& sphere_world, PlaneState& state) const {
    return test(
        sphere_world.centre - eye_, sphere_world.radius,
        [&](const Eigen::Vector3d&) { return sphere_world.radius; }, state);
}

Containment ViewVolume::test_planes(const Aabb& box_world, PlaneState& state) const {
    const Eigen::Vector3d low = box_world.low - eye_, high = box_world.high - eye_;
    const Eigen::Vector3d half = 0.5 * (high - low);
    return test(
        0.5 * (low + high), norm1(half),
        [&](const Eigen::Vector3d& normal) { return reach_along(normal, half); }, state);
}

Containment ViewVolume::test_planes(const OrientedBox& box_world, PlaneState& state) const {
    const Eigen::Matrix3d& rotation = box_world.frame_from_box.rotation;
    const LocalBox box = {box_world.frame_from_box.translation - eye_,
                          {rotation.col(0), rotation.col(1), rotation.col(2)},
                          box_world.half_extents};
    return test(
        box.centre, box.size(), [&](const Eigen::Vector3d& normal) { return box.reach(normal); },
        state);
}

// Whether a point is on the inner side of all planes except one, up to rounding.
bool ViewVolume::is_inside_but(int plane, const Eigen::Vector3d& p_eye) const {
    const double margin = kViewMargin * (norm1(p_eye) + far_);
    for (int i = 0; i < plane_count_; ++i) {
        if (i != plane && !(inward(i, p_eye) >= -margin)) return false;
    }
    return true;
}

// Squared distance of a point from the volume: 0 inside, else the smallest to the apex, to an edge, or to a face onto
// which the point projects.
double ViewVolume::squared_distance(const Eigen::Vector3d& p_eye) const {
    if (is_inside_but(-1, p_eye)) return 0.0;
    double least = dot(p_eye, p_eye);  // the apex
    for (int plane = 0; plane < plane_count_; ++plane) {
        const double at = inward(plane, p_eye);
        if (!(at < 0.0) || !(at * at < least)) continue;
        const Eigen::Vector3d on_plane = p_eye - normals_[static_cast<std::size_t>(plane)] * at;
        if (is_inside_but(plane, on_plane)) least = at * at;
    }
    const bool has_far = plane_count_ > kFarPlane;
    for (std::size_t i = 0; i < 4; ++i) {
        const double longest = has_far ? length(far_corners_[i]) : internal::kInfinity;
        const double along = std::clamp(dot(p_eye, edges_[i]), 0.0, longest);
        const Eigen::Vector3d apart = p_eye - edges_[i] * along;
        least = std::min(least, dot(apart, apart));
        if (!has_far) continue;
        const Eigen::Vector3d side = far_corners_[(i + 1) % 4] - far_corners_[i];
        const double share =
            std::clamp(dot(p_eye - far_corners_[i], side) / dot(side, side), 0.0, 1.0);
        const Eigen::Vector3d from_side = p_eye - far_corners_[i] - side * share;
        least = std::min(least, dot(from_side, from_side));
    }
    return least;
}

bool ViewVolume::meets(const BoundingSphere& sphere_world) const {
    const Eigen::Vector3d centre = sphere_world.centre - eye_;
    const double reach =
        sphere_world.radius + kViewMargin * (norm1(centre) + sphere_world.radius + far_);
    return !(squared_distance(centre) > reach * reach);
}

// Whether the projections of the volume and the box onto an axis are disjoint. Without a far plane the volume is
// infinite along its edges.
bool ViewVolume::is_separated(const LocalBox& box, const Eigen::Vector3d& axis) const {
    const double squared = dot(axis, axis);
    // The cross product of nearly parallel edges loses its direction to rounding; other axes cover this case.
    if (!(squared > 1e-20)) return false;
    const double norm = std::sqrt(squared);
    const double at = dot(axis, box.centre);
    const double reach =
        box.reach(axis) + kViewMargin * norm * (norm1(box.centre) + box.size() + far_);
    double low = 0.0, high = 0.0;  // of the volume, along the axis; 0 is the apex
    for (std::size_t i = 0; i < 4; ++i) {
        if (plane_count_ > kFarPlane) {
            const double corner = dot(axis, far_corners_[i]);
            low = std::min(low, corner);
            high = std::max(high, corner);
        } else {
            const double slope = dot(axis, edges_[i]);
            const double rounding = kViewMargin * norm;
            if (slope > rounding) high = internal::kInfinity;
            if (slope < -rounding) low = -internal::kInfinity;
        }
    }
    return at - reach > high || at + reach < low;
}

bool ViewVolume::meets(const LocalBox& box) const {
    for (int plane = 0; plane < plane_count_; ++plane) {
        const Eigen::Vector3d& normal = normals_[static_cast<std::size_t>(plane)];
        const double margin = kViewMargin * (norm1(box.centre) + box.size() + far_);
        if (inward(plane, box.centre) < -(box.reach(normal) + margin)) return false;
    }
    for (const Eigen::Vector3d& axis : box.axes) {
        if (is_separated(box, axis)) return false;
    }
    for (const Eigen::Vector3d& axis : box.axes) {
        for (const Eigen::Vector3d& edge : edges_) {
            if (is_separated(box, cross(axis, edge))) return false;
        }
        if (plane_count_ <= kFarPlane) continue;
        for (const Eigen::Vector3d& side : sides_) {
            if (is_separated(box, cross(axis, side))) return false;
        }
    }
    return true;
}

bool ViewVolume::meets(const Aabb& box_world) const {
    const Eigen::Vector3d low = box_world.low - eye_, high = box_world.high - eye_;
    return meets(
        LocalBox{0.5 * (low + high),
                 {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()},
                 0.5 * (high - low)});
}

bool ViewVolume::meets(const OrientedBox& box_world) const {
    const Eigen::Matrix3d& rotation = box_world.frame_from_box.rotation;
    return meets(LocalBox{box_world.frame_from_box.translation - eye_,
                          {rotation.col(0), rotation.col(1), rotation.col(2)},
                          box_world.half_extents});
}

// Clips the triangle by each plane in turn (I. Sutherland, G. Hodgman. Reentrant Polygon Clipping. CACM 17(1), 1974);
// corners within the margin of a plane count as inside.
bool ViewVolume::meets_triangle(const std::array<Eigen::Vector3d, 3>& corners_eye) const {
    std::array<Eigen::Vector3d, 8> polygon, clipped;
    std::size_t count = 3;
    double size = far_;
    for (std::size_t i = 0; i < 3; ++i) {
        polygon[i] = corners_eye[i];
        size = std::max(size, norm1(corners_eye[i]));
    }
    const double margin = kViewMargin * size;
    for (int plane = 0; plane < plane_count_; ++plane) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d& a = polygon[i];
            const Eigen::Vector3d& b = polygon[(i + 1) % count];
            const double at_a = inward(plane, a) + margin, at_b = inward(plane, b) + margin;
            if (at_a >= 0.0) clipped[kept++] = a;
            if ((at_a >= 0.0) != (at_b >= 0.0))
                clipped[kept++] = a + (b - a) * (at_a / (at_a - at_b));
        }
        if (kept == 0) return false;
        std::copy_n(clipped.begin(), kept, polygon.begin());
        count = kept;
    }
    return true;
}

bool ViewVolume::meets_triangles(const Pose& world_from_object, double scale,
                                 std::span<const Eigen::Vector3d> positions,
                                 std::span<const TriangleMesh::Triangle> triangles) const {
    // all positions are relative to the eye
    const Eigen::Vector3d origin = world_from_object.translation - eye_;
    const Eigen::Matrix3d rotation = scale * world_from_object.rotation;
    for (const TriangleMesh::Triangle& t : triangles) {
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t i = 0; i < 3; ++i)
            corners[i] = rotated(rotation, positions[t[i]]) + origin;
        if (meets_triangle(corners)) return true;
    }
    return false;
}

// Source: M. Stamminger, G. Drettakis. Perspective Shadow Maps. SIGGRAPH 2002 (casters are in the convex hull of the
//         receivers and the light).
// Deviation: each plane passes through the receivers' corner that is extreme along the plane's normal. If this normal
//            does not point away from the sun, the plane excludes no caster, however the corners are rounded.

namespace {

using internal::cross;
using internal::dot;
using internal::length;
using internal::norm1;
using internal::reach_along;

// Tolerance of comparisons, relative to the sum of the distance from the eye and the sizes of both volumes.
constexpr double kCasterMargin = 1e-11;
// Least sine of the angle between the sun's direction and an edge that gives a plane. For smaller angles the rounding
// error of their cross product would be near the margin.
constexpr double kLeastSine = 1e-4;
// An edge bounds the volume if both of its ends are within this distance of the extreme corner, relative to the
// receivers' size.
constexpr double kEdgeTolerance = 1e-9;

constexpr double kMostDistance = 1e9;

}  // namespace

bool has_shadows(const SunShadows& shadows) {
    const double sun_length = length(shadows.sun_direction);
    return std::isfinite(sun_length) && sun_length > 0.0 && shadows.distance > 0.0 &&
           shadows.distance <= kMostDistance;
}

CasterVolume::CasterVolume(const View& view, const SunShadows& shadows) : eye_(view.eye_world) {
    TERRANE_ASSERT(has_shadows(shadows), "direction and distance must be in range");
    const ViewVolume receivers(view, shadows.distance);
    const Eigen::Vector3d sun = shadows.sun_direction / length(shadows.sun_direction);
    // corners of the receivers relative to the eye: the eye itself, then the far plane's corners in order around it
    std::array<Eigen::Vector3d, 5> corners;
    corners[0] = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
        corners[i + 1] = receivers.far_corners()[i];
        size_ = std::max(size_, norm1(corners[i + 1]));
    }
    const auto range_along = [&](const Eigen::Vector3d& normal) {
        double low = internal::kInfinity, high = -internal::kInfinity;
        for (const Eigen::Vector3d& corner : corners) {
            low = std::min(low, dot(normal, corner));
            high = std::max(high, dot(normal, corner));
        }
        return std::array{low, high};
    };
    for (const Eigen::Vector3d& normal : receivers.normals()) {
        // a ray from a receiver to the sun may cross the other planes
        if (dot(normal, sun) >= 0.0) add(normal, range_along(normal)[0]);
    }
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t next = (i + 1) % 4;
        for (const auto& [from, to] :
             {std::array{std::size_t{0}, i + 1}, std::array{i + 1, next + 1}}) {
            const Eigen::Vector3d edge = corners[to] - corners[from];
            const Eigen::Vector3d product = cross(edge, sun);
            const double norm = length(product);
            if (!(norm > kLeastSine * length(edge))) continue;
            const Eigen::Vector3d normal = product / norm;
            const auto [low, high] = range_along(normal);
            const double at_from = dot(normal, corners[from]), at_to = dot(normal, corners[to]);
            const double tolerance = kEdgeTolerance * size_;
            if (std::max(at_from, at_to) <= low + tolerance) add(normal, low);
            if (std::min(at_from, at_to) >= high - tolerance) add(-normal, -high);
        }
    }
}

void CasterVolume::add(const Eigen::Vector3d& normal, double least) {
    // only a volume without thickness has more planes, because both sides of its edges are extreme
    if (plane_count_ < kMostPlanes) planes_[plane_count_++] = {normal, least};
}

// extent(normal): how far the bounding volume extends from its centre along a normal.
template <class Extent>
bool CasterVolume::meets(const Eigen::Vector3d& centre_eye, double size,
                         const Extent& extent) const {
    const double margin = kCasterMargin * (norm1(centre_eye) + size + size_);
    for (std::size_t i = 0; i < plane_count_; ++i) {
        const Plane& plane = planes_[i];
        if (dot(plane.normal, centre_eye) + extent(plane.normal) < plane.least - margin)
            return false;
    }
    return true;
}

bool CasterVolume::meets(const BoundingSphere& sphere_world) const {
    return meets(sphere_world.centre - eye_, sphere_world.radius,
                 [&](const Eigen::Vector3d&) { return sphere_world.radius; });
}

bool CasterVolume::meets(const Aabb& box_world) const {
    const Eigen::Vector3d low = box_world.low - eye_, high = box_world.high - eye_;
    const Eigen::Vector3d half = 0.5 * (high - low);
    return meets(0.5 * (low + high), norm1(half),
                 [&](const Eigen::Vector3d& normal) { return reach_along(normal, half); });
}

bool CasterVolume::meets(const OrientedBox& box_world) const {
    const Pose& pose = box_world.frame_from_box;
    const Eigen::Vector3d& half = box_world.half_extents;
    return meets(pose.translation - eye_, norm1(half), [&](const Eigen::Vector3d& normal) {
        return reach_along(internal::rotated_back(pose.rotation, normal), half);
    });
}

// Sources: J. Clark. Hierarchical Geometric Models for Visible Surface Algorithms. CACM 19(10), 1976 (hierarchy).
//          U. Assarsson, T. Moller. Optimized View Frustum Culling Algorithms for Bounding Boxes. Journal of Graphics
//          Tools 5(1), 2000 (masks of planes; the plane that last culled a node is tested first).
// Deviation: nodes are in depth-first order without pointers (base/aabb_tree.h): the objects below a node are one
//            range.

namespace {

using internal::AabbNode;

// Whether at most one plane is left. The plane test is then exact: the box is inside all other planes, and meets the
// volume if it reaches the inner side of this one.
bool is_one_plane(std::uint8_t mask) { return (mask & (mask - 1)) == 0; }

}  // namespace

struct CullTree::Nodes {
    std::vector<AabbNode> nodes;
    std::vector<std::uint32_t> order;  // [objects] in the order of the leaves
};

CullTree::CullTree(std::span<const Aabb> boxes_world) : nodes_(std::make_unique<Nodes>()) {
    internal::build_aabb_tree(boxes_world, nodes_->order, nodes_->nodes);
}
CullTree::CullTree(CullTree&&) noexcept = default;
CullTree& CullTree::operator=(CullTree&&) noexcept = default;
CullTree::~CullTree() = default;

std::size_t CullTree::size() const { return nodes_->order.size(); }

void CullTree::refit(std::span<const Aabb> boxes_world) {
    TERRANE_ASSERT(boxes_world.size() == size(), "there must be one box an object");
    internal::refit_aabb_tree(boxes_world, nodes_->nodes);
}

void CullTree::cull(const ViewVolume& volume, CullTest test, CullMemory& memory,
                    std::vector<std::uint32_t>& visible_out) const {
    const std::span<const AabbNode> nodes = nodes_->nodes;
    const std::span<const std::uint32_t> order = nodes_->order;
    if (memory.last_plane.size() != nodes.size()) memory.last_plane.assign(nodes.size(), 0);
    visible_out.clear();

    // An ancestor of the current node: the end of its nodes, and its mask of planes.
    struct Around {
        std::uint32_t end;
        std::uint8_t mask;
    };
    std::array<Around, AabbNode::kMaxDepth + 1> stack;
    std::size_t depth = 0;
    stack[0] = {static_cast<std::uint32_t>(nodes.size()), PlaneState::kAll};
    std::size_t leaf = 0;  // leaves before the current node
    for (std::uint32_t i = 0; i < nodes.size();) {
        const AabbNode& node = nodes[i];
        while (stack[depth].end <= i) --depth;
        PlaneState state = {stack[depth].mask, memory.last_plane[i]};
        Containment where = volume.test_planes(node.bounds, state);
        if (where == Containment::intersecting && test == CullTest::exact &&
            !is_one_plane(state.mask) && !volume.meets(node.bounds)) {
            where = Containment::outside;
        }
        memory.last_plane[i] = state.first;
        const std::size_t leaves = (node.end - i + 1) / 2;
        const bool is_leaf = node.item != AabbNode::kInner;
        if (where == Containment::intersecting && !is_leaf) {
            stack[++depth] = {node.end, state.mask};
            ++i;
            continue;
        }
        if (where != Containment::outside) {
            const auto first = order.begin() + static_cast<std::ptrdiff_t>(leaf);
            visible_out.insert(visible_out.end(), first,
                               first + static_cast<std::ptrdiff_t>(leaves));
        }
        leaf += leaves;
        i = node.end;
    }
}

void CullTree::find_casters(const CasterVolume& volume,
                            std::vector<std::uint32_t>& casters_out) const {
    casters_out.clear();
    internal::visit_leaves(
        nodes_->nodes, [&](const Aabb& box) { return volume.meets(box); },
        [&](std::uint32_t item) { casters_out.push_back(item); });
}

}  // namespace terrane
