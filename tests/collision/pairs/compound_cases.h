// SPDX-License-Identifier: MIT
#pragma once

#include "collision/pairs/pair_cases.h"
#include "pair_oracle.h"

#include <terrane/collision/shape_pairs.h>

#include <vector>

// Random compounds and brute-force queries over all their parts.
namespace terrane::test {

inline Shape as_shape(const ConvexShape& shape) {
    return std::visit([](const auto& each) { return Shape(each); }, shape);
}

inline internal::ConvexView view_of(const ConvexShape& shape) {
    if (const ConvexHull* hull = std::get_if<ConvexHull>(&shape)) return view_of(*hull);
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return *sphere;
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) return *capsule;
    return std::get<Box>(shape);
}

inline Pose composed(const Pose& a, const Pose& b) {
    return Pose{a.rotation * b.rotation, a.rotation * b.translation + a.translation};
}

/// A shape's convex pieces with their world poses.
struct Piece {
    ConvexShape shape;
    Pose world_from_piece;
};
inline std::vector<Piece> pieces_of(const Shape& shape, const Pose& pose) {
    if (const Compound* compound = std::get_if<Compound>(&shape)) {
        std::vector<Piece> pieces;
        for (const CompoundPart& part : compound->parts()) {
            pieces.push_back({part.shape, composed(pose, part.body_from_part)});
        }
        return pieces;
    }
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) return {{*sphere, pose}};
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) return {{*capsule, pose}};
    if (const Box* box = std::get_if<Box>(&shape)) return {{*box, pose}};
    return {{std::get<ConvexHull>(shape), pose}};
}

/// Least signed distance over all pairs of pieces, by the feature oracle.
inline double oracle_least(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
    double least = std::numeric_limits<double>::infinity();
    for (const Piece& p : pieces_of(a, pose_a)) {
        for (const Piece& q : pieces_of(b, pose_b)) {
            least = std::min(least, oracle_distance(view_of(p.shape), p.world_from_piece,
                                                    view_of(q.shape), q.world_from_piece));
        }
    }
    return least;
}

/// The same by the library's query for two convex shapes.
inline double least_distance(const Shape& a, const Pose& pose_a, const Shape& b,
                             const Pose& pose_b) {
    double least = std::numeric_limits<double>::infinity();
    for (const Piece& p : pieces_of(a, pose_a)) {
        for (const Piece& q : pieces_of(b, pose_b)) {
            least = std::min(least, signed_distance(as_shape(p.shape), p.world_from_piece,
                                                    as_shape(q.shape), q.world_from_piece)
                                        .distance);
        }
    }
    return least;
}

/// A box divided into tiles along its three axes.
inline Compound tiled_box(const Eigen::Vector3d& half, const std::array<int, 3>& counts) {
    std::vector<CompoundPart> parts;
    const Eigen::Vector3d step(2.0 * half[0] / counts[0], 2.0 * half[1] / counts[1],
                               2.0 * half[2] / counts[2]);
    for (int x = 0; x < counts[0]; ++x) {
        for (int y = 0; y < counts[1]; ++y) {
            for (int z = 0; z < counts[2]; ++z) {
                const Eigen::Vector3d centre =
                    -half + step.cwiseProduct(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
                parts.push_back({Box{0.5 * step}, {.translation = centre}});
            }
        }
    }
    return Compound::create(parts).value();
}

inline ConvexShape random_convex(Random& random, int kind) {
    const double size = random.between(0.1, 0.6);
    if (kind == 0) return Sphere{size};
    if (kind == 1) return Capsule{0.5 * size, random.between(0.0, 0.6)};
    if (kind == 2) return Box{{size, random.between(0.0, 0.6), random.between(0.1, 0.6)}};
    std::vector<Eigen::Vector3d> points;
    const int count = 1 + static_cast<int>(random.between(0.0, 11.0));
    for (int i = 0; i < count; ++i) points.push_back(random.between(0.2, 0.7) * random.direction());
    return ConvexHull::create(points).value();
}

/// Up to six parts of all kinds, rotated and close together.
inline Compound random_compound(Random& random) {
    std::vector<CompoundPart> parts(1 + static_cast<std::size_t>(random.between(0.0, 6.0)));
    for (CompoundPart& part : parts) {
        part.shape = random_convex(random, static_cast<int>(random.between(0.0, 4.0)));
        if (random.between(0.0, 1.0) < 0.7) part.body_from_part.rotation = random.rotation();
        part.body_from_part.translation = random.between(0.0, 0.9) * random.direction();
    }
    return Compound::create(parts).value();
}

/// Triangles of a bent sheet, some of them needles or without area.
inline Compound random_mesh(Random& random) {
    constexpr std::uint32_t kSide = 4;
    std::vector<Eigen::Vector3d> vertices;
    const double bend = random.between(-0.3, 0.3);
    for (std::uint32_t y = 0; y < kSide; ++y) {
        for (std::uint32_t x = 0; x < kSide; ++x) {
            const double u = x / 3.0 - 0.5, v = y / 3.0 - 0.5;
            vertices.emplace_back(2.0 * u, 1.6 * v, bend * (u * u - v) + random.between(-0.1, 0.1));
        }
    }
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
        for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
            const std::uint32_t i = y * kSide + x;
            triangles.push_back({i, i + 1, i + kSide + 1});
            triangles.push_back({i, i + kSide + 1, i + kSide});
        }
    }
    triangles.push_back({0, 1, 0});
    return Compound::from_triangles(vertices, triangles).value();
}

/// Kinds of shapes that a compound is tested against.
inline constexpr std::array<const char*, 6> kOtherNames = {"sphere", "capsule",  "box",
                                                           "hull",   "compound", "mesh"};

/// Made once, because making a compound costs more than querying it.
inline const std::vector<Shape>& others_of(int kind) {
    static const std::array<std::vector<Shape>, 6> all = [] {
        std::array<std::vector<Shape>, 6> made;
        Random random(20261122);
        for (int k = 0; k < 6; ++k) {
            for (int i = 0; i < 200; ++i) {
                made[static_cast<std::size_t>(k)].push_back(
                    k < 4    ? as_shape(random_convex(random, k))
                    : k == 4 ? Shape(random_compound(random))
                             : Shape(random_mesh(random)));
            }
        }
        return made;
    }();
    return all[static_cast<std::size_t>(kind)];
}

struct CompoundCase {
    Shape a, b;
    Pose pose_a, pose_b;
};

/// Either shape may be the compound; about half of the cases overlap.
inline CompoundCase random_compound_case(Random& random, int kind, int i) {
    const auto pick = [&](int k) {
        return others_of(k)[static_cast<std::size_t>(random.between(0.0, 200.0))];
    };
    CompoundCase c{pick(i % 7 == 3 ? 5 : 4), pick(kind), {}, {}};
    if (i % 2 == 1) std::swap(c.a, c.b);
    if (i % 4 != 2) c.pose_a.rotation = random.rotation();
    if (i % 3 != 2) c.pose_b.rotation = random.rotation();
    c.pose_a.translation = 3.0 * random.direction();
    c.pose_b.translation = c.pose_a.translation + random.between(0.0, 2.0) * random.direction();
    return c;
}

}  // namespace terrane::test
