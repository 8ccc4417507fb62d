// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/convex_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

// Oracles in extended precision by brute force over all pairs of features; they share no method with the library.
namespace terrane::test {

using Long = long double;
using LongVector = Eigen::Matrix<Long, 3, 1>;

/// The features of a convex shape, in world axes.
struct Solid {
    std::vector<LongVector> vertices;
    std::vector<std::pair<LongVector, LongVector>> edges;
    struct Face {
        LongVector normal;
        std::vector<LongVector> loop;
        Long area = 0;  ///< twice the area; 0 for the sides of a box without thickness
    };
    std::vector<Face> faces;
    Long radius = 0;
};

inline Solid make_solid(const internal::ConvexView& shape, const Pose& pose,
                        const Eigen::Vector3d& origin) {
    Eigen::Matrix<Long, 3, 3> r = pose.rotation.cast<Long>();
    for (int round = 0; round < 3; ++round) {  // orthonormal to extended precision
        r = (r *
             (Eigen::Matrix<Long, 3, 3>::Identity() * Long(1.5) - r.transpose() * r * Long(0.5)))
                .eval();
    }
    const LongVector c = pose.translation.cast<Long>() - origin.cast<Long>();
    const auto world = [&](const Eigen::Vector3d& p) { return LongVector(r * p.cast<Long>() + c); };
    Solid solid;
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        solid.vertices = {c};
        solid.radius = sphere->radius;
        return solid;
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        solid.vertices = {world({0, 0, -capsule->half_height}),
                          world({0, 0, capsule->half_height})};
        solid.edges = {{solid.vertices[0], solid.vertices[1]}};
        solid.radius = capsule->radius;
        return solid;
    }
    internal::BoxStorage storage;
    const Box* box = std::get_if<Box>(&shape);
    if (box != nullptr && box->half_extents == Eigen::Vector3d::Zero()) {
        solid.vertices = {c};
        return solid;
    }
    const internal::Polyhedron p = box != nullptr
                                       ? internal::box_polyhedron(box->half_extents, storage)
                                       : std::get<internal::HullView>(shape).shape;
    for (const Eigen::Vector3d& v : p.vertices) solid.vertices.push_back(world(v));
    for (const auto& e : p.edges) {
        solid.edges.push_back({solid.vertices[e.from], solid.vertices[e.to]});
    }
    for (const auto& f : p.faces) {
        Solid::Face face;
        for (std::uint32_t k = 0; k < f.count; ++k) {
            face.loop.push_back(solid.vertices[p.loops[f.first + k]]);
        }
        face.normal = (r * f.normal.cast<Long>()).normalized();
        for (std::uint32_t k = 2; k < f.count; ++k) {
            const LongVector u = face.loop[k - 1] - face.loop[0], v = face.loop[k] - face.loop[0];
            face.area += u.cross(v).norm();
        }
        solid.faces.push_back(face);
    }
    return solid;
}

inline Long gap_of(const Solid& a, const Solid& b, const LongVector& n) {
    Long low = std::numeric_limits<Long>::infinity();
    Long high = -low;
    for (const LongVector& p : a.vertices) low = std::min(low, n.dot(p));
    for (const LongVector& p : b.vertices) high = std::max(high, n.dot(p));
    return low - high;
}

/// Largest gap between the cores along all face normals and cross products of edges, in both directions.
inline Long widest_gap(const Solid& a, const Solid& b) {
    Long widest = -std::numeric_limits<Long>::infinity();
    const auto consider = [&](const LongVector& n) {
        widest = std::max({widest, gap_of(a, b, n), gap_of(a, b, -n)});
    };
    for (const auto& f : a.faces) consider(f.normal);
    for (const auto& f : b.faces) consider(f.normal);
    for (const auto& e : a.edges) {
        for (const auto& f : b.edges) {
            const LongVector u = e.second - e.first, v = f.second - f.first;
            const LongVector m = u.cross(v);
            if (m.norm() > 1e-14L * u.norm() * v.norm()) consider(m.normalized());
        }
    }
    return widest;
}

inline Long point_to_face(const LongVector& p, const Solid::Face& face) {
    if (face.area == 0) return std::numeric_limits<Long>::infinity();
    for (std::size_t i = 0; i < face.loop.size(); ++i) {
        const LongVector& q = face.loop[i];
        const LongVector e = face.loop[(i + 1) % face.loop.size()] - q;
        if (e.cross(p - q).dot(face.normal) < 0) return std::numeric_limits<Long>::infinity();
    }
    return std::abs(face.normal.dot(p - face.loop[0]));
}

inline Long point_to_segment(const LongVector& p, const LongVector& q, const LongVector& v) {
    const Long vv = v.dot(v);
    const Long t = vv > 0 ? std::clamp(v.dot(p - q) / vv, Long(0), Long(1)) : Long(0);
    return (p - (q + t * v)).norm();
}

/// Distance between two separated cores.
inline Long distance_apart(const Solid& a, const Solid& b) {
    Long best = std::numeric_limits<Long>::infinity();
    for (const auto& p : a.vertices) {
        for (const auto& q : b.vertices) best = std::min(best, (p - q).norm());
        for (const auto& e : b.edges) {
            best = std::min(best, point_to_segment(p, e.first, e.second - e.first));
        }
        for (const auto& f : b.faces) best = std::min(best, point_to_face(p, f));
    }
    for (const auto& p : b.vertices) {
        for (const auto& e : a.edges) {
            best = std::min(best, point_to_segment(p, e.first, e.second - e.first));
        }
        for (const auto& f : a.faces) best = std::min(best, point_to_face(p, f));
    }
    for (const auto& e : a.edges) {
        for (const auto& f : b.edges) {
            const LongVector u = e.second - e.first, v = f.second - f.first, r = f.first - e.first;
            const LongVector m = u.cross(v);
            const Long mm = m.dot(m);
            if (!(mm > 0)) continue;
            const Long s = r.cross(v).dot(m) / mm;
            const Long t = r.cross(u).dot(m) / mm;
            if (s < 0 || s > 1 || t < 0 || t > 1) continue;
            best = std::min(best, std::abs(r.dot(m)) / std::sqrt(mm));
        }
    }
    return best;
}

/// Signed distance by brute force.
inline double oracle_distance(const internal::ConvexView& a, const Pose& pose_a,
                              const internal::ConvexView& b, const Pose& pose_b) {
    const Solid solid_a = make_solid(a, pose_a, pose_a.translation);
    const Solid solid_b = make_solid(b, pose_b, pose_a.translation);
    const Long radii = solid_a.radius + solid_b.radius;
    const Long widest = widest_gap(solid_a, solid_b);
    if (!(widest > -std::numeric_limits<Long>::infinity()) || widest >= -1e-17L) {
        return static_cast<double>(distance_apart(solid_a, solid_b) - radii);
    }
    return static_cast<double>(widest - radii);
}

}  // namespace terrane::test
