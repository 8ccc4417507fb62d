// SPDX-License-Identifier: MIT
#include "ground/column/local_shape.h"

#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>

namespace terrane::internal {
namespace {

// Smallest downward component of a unit face normal for which the face is used as a lower bound of the hull.
constexpr double kLeastSteep = 1e-3;

// Below this cosine a feature counts as perpendicular to a direction.
constexpr double kPerpendicular = 1e-9;

/// Visits the faces around a vertex, each of them twice.
template <class Visit>
void visit_faces_around(const Polyhedron& shape, std::uint32_t vertex, Visit visit) {
    for (std::uint32_t k = shape.first_neighbour[vertex]; k < shape.first_neighbour[vertex + 1];
         ++k) {
        const Polyhedron::Edge* edge = find_edge(shape, vertex, shape.neighbours[k]);
        if (edge == nullptr || edge->left == Polyhedron::kNoFace) continue;
        visit(edge->left);
        visit(edge->right);
    }
}

void add_planes(LocalHull& hull) {
    // The most nearly horizontal faces around the lowest vertex.
    constexpr std::size_t kFaces = 4;
    const Polyhedron& shape = *hull.shape;
    const Eigen::Vector3d down = hull.to_body(-Eigen::Vector3d::UnitZ());
    std::array<std::uint32_t, kFaces> faces;
    std::size_t count = 0;
    const auto is_flatter = [&](std::uint32_t a, std::uint32_t b) {
        const double of_a = dot(shape.faces[a].normal, down);
        const double of_b = dot(shape.faces[b].normal, down);
        return of_a > of_b || (of_a == of_b && a < b);
    };
    visit_faces_around(shape, find_extreme(shape, down), [&](std::uint32_t face) {
        if (dot(shape.faces[face].normal, down) < kLeastSteep) return;
        std::size_t at = count;
        while (at > 0 && is_flatter(face, faces[at - 1])) --at;
        if (at == kFaces || (at > 0 && faces[at - 1] == face)) return;
        if (count < kFaces) ++count;
        for (std::size_t i = count - 1; i > at; --i) faces[i] = faces[i - 1];
        faces[at] = face;
    });
    hull.plane_count = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Polyhedron::Face& face = shape.faces[faces[i]];
        const Eigen::Vector3d n = -rotated(hull.rotation, face.normal);
        hull.planes[hull.plane_count++] = {n, face.offset + dot(n, hull.middle)};
    }
    hull.face_count = count;
    // Four planes of fixed slope, which bound rounded hulls well.
    constexpr double kAcross = 0.36;
    constexpr double kUp = 0.8606974497462901;  // makes (kAcross, kAcross, kUp) a unit vector
    for (const double x : {-kAcross, kAcross}) {
        for (const double y : {-kAcross, kAcross}) {
            const Eigen::Vector3d n(x, y, kUp);
            hull.planes[hull.plane_count++] = {n, hull.drop(n)};
        }
    }
}

// Sets the strip along the line between two vertices: the hull's extremes along the longer side of the bounding box.
void set_strip(LocalHull& hull, std::uint32_t from, std::uint32_t to) {
    constexpr double kNarrow = 0.25;  // width relative to the length
    const Eigen::Vector3d along = hull.vertex(to) - hull.vertex(from);
    const Eigen::Vector3d across(-along[1], along[0], 0.0);
    const double low = dot(across, hull.vertex(hull.lowest(across)));
    const double high = dot(across, hull.vertex(hull.lowest(-across)));
    hull.strip = {across[0], across[1], low, high};
    hull.is_narrow = high - low < kNarrow * dot(across, across);
}

}  // namespace

void make_local_hull(const ConvexHull& hull, const Eigen::Matrix3d& rotation, LocalHull& hull_out) {
    hull_out.shape = &polyhedron(hull);
    hull_out.rotation = orthonormalized(rotation);
    std::array<std::uint32_t, 3> lows, highs;
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d axis = hull_out.to_body(Eigen::Vector3d::Unit(i));
        const std::span<const Eigen::Vector3d> vertices = hull_out.shape->vertices;
        const std::uint32_t low = find_extreme(*hull_out.shape, -axis);
        const std::uint32_t high = find_extreme(*hull_out.shape, axis);
        lows[static_cast<std::size_t>(i)] = low;
        highs[static_cast<std::size_t>(i)] = high;
        // Rounded as in vertex().
        const double low_at = rotated(hull_out.rotation, vertices[low])[i];
        const double high_at = rotated(hull_out.rotation, vertices[high])[i];
        hull_out.middle[i] = 0.5 * (low_at + high_at);
        hull_out.bounds[i] = std::max(high_at - hull_out.middle[i], hull_out.middle[i] - low_at);
    }
    add_planes(hull_out);
    const std::size_t longer = hull_out.bounds[1] > hull_out.bounds[0] ? 1 : 0;
    set_strip(hull_out, lows[longer], highs[longer]);
}

const Polyhedron::Edge* find_edge(const Polyhedron& shape, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t from = std::min(a, b);
    const std::uint32_t to = std::max(a, b);
    const auto edge = std::lower_bound(shape.edges.begin(), shape.edges.end(), 0,
                                       [&](const Polyhedron::Edge& e, int) {
                                           return e.from < from || (e.from == from && e.to < to);
                                       });
    return edge != shape.edges.end() && edge->from == from && edge->to == to ? &*edge : nullptr;
}

ShapeFeature find_deepest(const LocalHull& hull, const Eigen::Vector3d& n,
                          Eigen::Vector3d& middle_out) {
    const Polyhedron& shape = *hull.shape;
    const std::uint32_t lowest = hull.lowest(n);
    const Eigen::Vector3d down = -hull.to_body(n);
    std::uint32_t beside = lowest;
    std::size_t level_count = 0;
    for (std::uint32_t k = shape.first_neighbour[lowest]; k < shape.first_neighbour[lowest + 1];
         ++k) {
        const std::uint32_t other = shape.neighbours[k];
        const Eigen::Vector3d edge = shape.vertices[other] - shape.vertices[lowest];
        if (std::abs(dot(down, edge)) > kPerpendicular * length(edge)) continue;
        beside = other;
        ++level_count;
    }
    if (level_count == 0) {
        middle_out = hull.vertex(lowest);
        return {lowest, lowest};
    }
    if (level_count == 1) {
        middle_out = 0.5 * (hull.vertex(lowest) + hull.vertex(beside));
        return {std::min(lowest, beside), std::max(lowest, beside)};
    }
    std::uint32_t face = Polyhedron::kNoFace;
    visit_faces_around(shape, lowest, [&](std::uint32_t f) {
        if (face == Polyhedron::kNoFace) face = f;
        const double of_f = dot(shape.faces[f].normal, down);
        const double of_face = dot(shape.faces[face].normal, down);
        if (of_f > of_face || (of_f == of_face && f < face)) face = f;
    });
    const Polyhedron::Face& loop = shape.faces[face];
    middle_out = Eigen::Vector3d::Zero();
    for (std::uint32_t k = 0; k < loop.count; ++k) {
        middle_out += hull.vertex(shape.loops[loop.first + k]);
    }
    middle_out /= static_cast<double>(loop.count);
    return {face, ShapeFeature::kFace};
}

namespace {

DeepestPoint deepest_of_round(const LocalShape& shape, const Eigen::Vector3d& n) {
    Eigen::Vector3d p = shape.centre;
    ShapeFeature feature{0, shape.has_core() ? 1u : 0u};
    const double along = dot(n, shape.core);
    if (std::abs(along) > kPerpendicular * length(shape.core)) {
        p += along > 0.0 ? -shape.core : shape.core;
        feature = along > 0.0 ? ShapeFeature{0, 0} : ShapeFeature{1, 1};
    }
    return {p - shape.radius * n, feature};
}

DeepestPoint deepest_of_box(const LocalShape& shape, const Eigen::Vector3d& n) {
    Eigen::Vector3d p = shape.centre;
    std::uint32_t corner = 0;
    std::uint32_t level = 0;  // bits of the axes that are perpendicular to n
    for (std::uint32_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<Eigen::Index>(i);
        const double along = dot(n, shape.axes[i]);
        if (std::abs(along) > kPerpendicular) {
            p += (along > 0.0 ? -shape.half[axis] : shape.half[axis]) * shape.axes[i];
            if (!(along > 0.0)) corner |= 1u << i;
        } else {
            level |= 1u << i;
        }
    }
    for (std::uint32_t i = 0; i < 3; ++i) {
        if (level == (7u ^ 1u << i)) {
            return {p, {2 * i + (corner >> i & 1u), ShapeFeature::kFace}};
        }
    }
    return {p, {corner, corner | level}};
}

void make_local(const Sphere& sphere, const Eigen::Matrix3d&, LocalHull&, LocalShape& local) {
    local.radius = sphere.radius;
    local.smallest = sphere.radius;
}

void make_local(const Capsule& capsule, const Eigen::Matrix3d& rotation, LocalHull&,
                LocalShape& local) {
    local.radius = capsule.radius;
    local.core = capsule.half_height * rotation.col(2);
    local.smallest = capsule.radius;
}

void make_local(const Box& box, const Eigen::Matrix3d& rotation, LocalHull&, LocalShape& local) {
    local.kind = ShapeKind::box;
    const Eigen::Matrix3d exact = orthonormalized(rotation);
    for (int i = 0; i < 3; ++i) local.axes[static_cast<std::size_t>(i)] = exact.col(i);
    local.half = box.half_extents;
    for (std::size_t k = 0; k < 8; ++k) {
        local.corners[k] = ((k & 1) != 0 ? local.half[0] : -local.half[0]) * local.axes[0] +
                           ((k & 2) != 0 ? local.half[1] : -local.half[1]) * local.axes[1] +
                           ((k & 4) != 0 ? local.half[2] : -local.half[2]) * local.axes[2];
    }
    local.smallest = std::min({local.half[0], local.half[1], local.half[2]});
}

void make_local(const ConvexHull& hull, const Eigen::Matrix3d& rotation, LocalHull& hull_out,
                LocalShape& local) {
    make_local_hull(hull, orthonormalized(rotation), hull_out);
    local.kind = ShapeKind::hull;
    local.hull = &hull_out;
    local.centre = hull_out.middle;
    local.bounds = hull_out.bounds;
    local.offset = hull_out.middle;
    local.smallest = smallest_half_extent(hull);
}

}  // namespace

DeepestPoint LocalShape::deepest(const Eigen::Vector3d& n) const {
    if (kind == ShapeKind::round) return deepest_of_round(*this, n);
    if (kind == ShapeKind::box) return deepest_of_box(*this, n);
    DeepestPoint found;
    found.feature = find_deepest(*hull, n, found.point);
    found.point += centre;
    return found;
}

ShapeFeature LocalShape::core_feature(const Eigen::Vector3d& on_core) const {
    constexpr double kEnd = 1.0 - 1e-9;  // fraction of the distance from the centre to an end
    if (!has_core()) return {0, 0};
    const double along = dot(on_core - centre, core) / dot(core, core);
    if (along >= kEnd) return {1, 1};
    return {0, along <= -kEnd ? 0u : 1u};
}

template <class Convex>
LocalShape make_local_shape(const Convex& shape, const Eigen::Matrix3d& rotation,
                            LocalHull& hull_out) {
    LocalShape local;
    make_local(shape, rotation, hull_out, local);
    if (local.kind != ShapeKind::hull) {
        for (int i = 0; i < 3; ++i) local.bounds[i] = local.drop(Eigen::Vector3d::Unit(i));
    }
    return local;
}

template LocalShape make_local_shape(const Sphere&, const Eigen::Matrix3d&, LocalHull&);
template LocalShape make_local_shape(const Capsule&, const Eigen::Matrix3d&, LocalHull&);
template LocalShape make_local_shape(const Box&, const Eigen::Matrix3d&, LocalHull&);
template LocalShape make_local_shape(const ConvexHull&, const Eigen::Matrix3d&, LocalHull&);

LocalBody::LocalBody(const Shape& shape, const Eigen::Matrix3d& rotation,
                     const Eigen::Vector3d& origin)
    : rotation_(rotation), origin_(origin) {
    const auto make = [&](const auto& each) { whole_ = make_local_shape(each, rotation, hull_); };
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        make(*sphere);
    } else if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        make(*capsule);
    } else if (const Box* box = std::get_if<Box>(&shape)) {
        make(*box);
    } else if (const ConvexHull* hull = std::get_if<ConvexHull>(&shape)) {
        make(*hull);
    } else {
        compound_ = &compound_data(std::get<Compound>(shape));
        rotation_ = orthonormalized(rotation);
        const Aabb& all = compound_->tree[0].bounds;
        const Eigen::Vector3d middle = 0.5 * (all.low + all.high);
        whole_.offset = rotated(rotation_, middle);
        whole_.centre = whole_.offset;
        whole_.bounds = around(all.high - middle);
        whole_.smallest = compound_->smallest_half_extent;
    }
    whole_.centre += origin;
}

LocalShape LocalBody::part(std::uint32_t index, LocalHull& hull_out) const {
    if (!is_compound()) return whole_;
    const CompoundPart& part = compound_->parts[index];
    Eigen::Matrix3d rotation;
    for (int i = 0; i < 3; ++i) {
        rotation.col(i) = rotated(rotation_, part.body_from_part.rotation.col(i));
    }
    rotation = orthonormalized(rotation);
    LocalShape shape = std::visit(
        [&](const auto& each) { return make_local_shape(each, rotation, hull_out); }, part.shape);
    const Eigen::Vector3d offset = rotated(rotation_, part.body_from_part.translation);
    shape.offset += offset;
    shape.centre += offset;
    shape.centre += origin_;
    return shape;
}

Eigen::Vector3d LocalBody::around(const Eigen::Vector3d& half) const {
    Eigen::Vector3d bounds;
    for (int i = 0; i < 3; ++i) {
        bounds[i] = std::abs(rotation_(i, 0)) * half[0] + std::abs(rotation_(i, 1)) * half[1] +
                    std::abs(rotation_(i, 2)) * half[2];
    }
    // Slightly wider, to cover the rounding of parts and their bounds.
    constexpr double kHair = 1e-12;
    return bounds + Eigen::Vector3d::Constant(kHair * (1.0 + compound_->bounding_radius));
}

}  // namespace terrane::internal
