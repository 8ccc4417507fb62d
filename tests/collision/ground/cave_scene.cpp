// SPDX-License-Identifier: MIT
#include "collision/ground/cave_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace terrane::test {
namespace {

using Vec = Eigen::Vector3d;

/// Distance of a point from a triangle: by barycentric coordinates of its projection, or to the edges.
double distance_to(const Vec& p, const std::array<Vec, 3>& t) {
    const Vec n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    bool is_inside = true;
    double edges = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec a = t[i], e = t[(i + 1) % 3] - a;
        is_inside = is_inside && e.cross(p - a).dot(n) >= 0.0;
        const double s = std::clamp((p - a).dot(e) / e.squaredNorm(), 0.0, 1.0);
        edges = std::min(edges, (p - a - s * e).norm());
    }
    return is_inside ? std::abs((p - t[0]).dot(n)) : edges;
}

struct RoundPoint {
    Vec p;
    double radius;
};

void add_points(const Sphere& s, std::vector<RoundPoint>& out) {
    out.push_back({Vec::Zero(), s.radius});
}
void add_points(const Capsule& c, std::vector<RoundPoint>& out) {
    for (int i = -4; i <= 4; ++i)
        out.push_back({Vec(0.0, 0.0, 0.25 * i * c.half_height), c.radius});
}
void add_points(const Box& b, std::vector<RoundPoint>& out) {
    for (int i = -2; i <= 2; ++i) {
        for (int j = -2; j <= 2; ++j) {
            for (int k = -2; k <= 2; ++k) {
                if (std::max({std::abs(i), std::abs(j), std::abs(k)}) < 2) continue;
                out.push_back({b.half_extents.cwiseProduct(0.5 * Vec(i, j, k)), 0.0});
            }
        }
    }
}
void add_points(const ConvexHull& h, std::vector<RoundPoint>& out) {
    for (const Vec& v : h.vertices()) out.push_back({v, 0.0});
}
void add_points(const Compound& c, std::vector<RoundPoint>& out) {
    for (const CompoundPart& part : c.parts()) {
        std::vector<RoundPoint> own;
        std::visit([&](const auto& each) { add_points(each, own); }, part.shape);
        for (const RoundPoint& point : own)
            out.push_back({part.body_from_part * point.p, point.radius});
    }
}

/// Depth of a point in a shape, metres; only for boxes and round shapes.
double depth_in(const Shape& shape, const Vec& p) {
    if (const Sphere* s = std::get_if<Sphere>(&shape)) return s->radius - p.norm();
    if (const Capsule* c = std::get_if<Capsule>(&shape)) {
        return c->radius -
               (p - Vec(0.0, 0.0, std::clamp(p.z(), -c->half_height, c->half_height))).norm();
    }
    if (const Box* b = std::get_if<Box>(&shape)) return (b->half_extents - p.cwiseAbs()).minCoeff();
    return 0.0;
}

}  // namespace

void add_rectangle(SolidTriangles& solid, const Vec& corner, const Vec& u, const Vec& v,
                   int parts) {
    const Vec du = u / parts, dv = v / parts;
    for (int i = 0; i < parts; ++i) {
        for (int j = 0; j < parts; ++j) {
            const Vec a = corner + u * (double(i) / parts) + v * (double(j) / parts);
            const auto first = static_cast<std::uint32_t>(solid.vertices_world.size());
            for (const Vec& p : {a, Vec(a + du), Vec(a + du + dv), Vec(a + dv)}) {
                solid.vertices_world.push_back(p);
            }
            if ((i + j) % 2 == 0) {
                solid.triangles.push_back({first, first + 1, first + 2});
                solid.triangles.push_back({first, first + 2, first + 3});
            } else {
                solid.triangles.push_back({first, first + 1, first + 3});
                solid.triangles.push_back({first + 1, first + 2, first + 3});
            }
            solid.parts.insert(solid.parts.end(), 2, SolidPart::cavity);
        }
    }
}

bool CaveScene::is_air(const Vec& p) const {
    return p.z() > kTop || std::any_of(air.begin(), air.end(), [&](const AirBox& box) {
               return (p - box.low).minCoeff() > 0.0 && (box.high - p).minCoeff() > 0.0;
           });
}

double CaveScene::distance(const Vec& p, std::span<const std::array<Vec, 3>> near) const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& triangle : near) least = std::min(least, distance_to(p, triangle));
    return is_air(p) ? least : -least;
}

double CaveScene::depth(const Shape& shape, const Pose& pose) const {
    std::vector<RoundPoint> points;
    std::visit([&](const auto& each) { add_points(each, points); }, shape);
    const double radius = bounding_radius(shape);
    std::vector<std::array<Vec, 3>> near;
    for (const auto& t : triangles) {
        const Vec low = t[0].cwiseMin(t[1]).cwiseMin(t[2]),
                  high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
        const Vec beyond = (low - pose.translation).cwiseMax(pose.translation - high);
        if (beyond.maxCoeff() < radius + 0.5) near.push_back(t);
    }
    constexpr double kFar = 1e3;
    // With no triangle nearby the shape is entirely in air or entirely in the solid.
    if (near.empty()) return is_air(pose.translation) ? -kFar : kFar;
    double deepest = -std::numeric_limits<double>::infinity();
    for (const RoundPoint& point : points) {
        deepest = std::max(deepest, point.radius - distance(pose * point.p, near));
    }
    // Edges of the solid inside the shape, sampled along the edges of all triangles.
    for (const auto& triangle : near) {
        for (std::size_t i = 0; i < 3; ++i) {
            for (int k = 0; k < 4; ++k) {
                const Vec p = triangle[i] + 0.25 * k * (triangle[(i + 1) % 3] - triangle[i]);
                deepest = std::max(
                    deepest, depth_in(shape, pose.rotation.transpose() * (p - pose.translation)));
            }
        }
    }
    return deepest;
}

CaveScene make_cave(double shift, bool is_closed) {
    const Vec o(shift, shift, 0.0);
    const Vec x = Vec::UnitX(), y = Vec::UnitY(), z = Vec::UnitZ();
    // Cavern of 20 x 20 x 10 m, shaft of 6 x 6 m.
    const double low = 40.0, high = 60.0, floor = 10.0, roof = 20.0, a = 46.0, b = 52.0;
    SolidTriangles solid;
    const auto add = [&](const Vec& corner, const Vec& u, const Vec& v, int parts) {
        add_rectangle(solid, o + corner, u, v, parts);
    };
    add(Vec(low, low, floor), 20.0 * x, 20.0 * y, 10);  // floor
    add(Vec(low, low, floor), 20.0 * y, 10.0 * z, 5);   // west
    add(Vec(high, low, floor), 10.0 * z, 20.0 * y, 5);  // east
    add(Vec(low, low, floor), 10.0 * z, 20.0 * x, 5);   // south
    add(Vec(low, high, floor), 20.0 * x, 10.0 * z, 5);  // north
    if (is_closed) {
        add(Vec(low, low, roof), 20.0 * y, 20.0 * x, 10);
    } else {
        add(Vec(low, low, roof), (a - low) * y, 20.0 * x, 6);   // roof, south
        add(Vec(low, b, roof), (high - b) * y, 20.0 * x, 6);    // north
        add(Vec(low, a, roof), (b - a) * y, (a - low) * x, 3);  // west
        add(Vec(b, a, roof), (b - a) * y, (high - b) * x, 3);   // east
        const double up = CaveScene::kTop - roof;
        add(Vec(a, a, roof), (b - a) * y, up * z, 4);
        add(Vec(b, a, roof), up * z, (b - a) * y, 4);
        add(Vec(a, a, roof), up * z, (b - a) * x, 4);
        add(Vec(a, b, roof), (b - a) * x, up * z, 4);
        for (int row = int(a); row < int(b); ++row) {
            for (int column = int(a); column < int(b); ++column) {
                const int cell = row * 128 + column;
                solid.replaced.push_back(static_cast<std::uint16_t>(2 * cell));
                solid.replaced.push_back(static_cast<std::uint16_t>(2 * cell + 1));
            }
        }
    }
    TableGroundSettings settings;
    settings.origin_x = settings.origin_y = shift;
    settings.solid = [&](const Chunk&) { return std::make_shared<const SolidSurface>(solid); };
    CaveScene scene{
        make_test_ground([](double, double) { return CaveScene::kTop; }, settings), {}, {}};
    for (const auto& t : solid.triangles) {
        scene.triangles.push_back(
            {solid.vertices_world[t[0]], solid.vertices_world[t[1]], solid.vertices_world[t[2]]});
    }
    scene.air.push_back({o + Vec(low, low, floor), o + Vec(high, high, roof)});
    if (!is_closed)
        scene.air.push_back({o + Vec(a, a, roof - 1.0), o + Vec(b, b, CaveScene::kTop + 1.0)});
    // The ground around the mouth, as four strips.
    const double t = CaveScene::kTop;
    const auto add_quad = [&](double x0, double y0, double x1, double y1) {
        const Vec p = o + Vec(x0, y0, t), q = o + Vec(x1, y0, t), r = o + Vec(x1, y1, t),
                  s = o + Vec(x0, y1, t);
        scene.triangles.push_back({p, q, r});
        scene.triangles.push_back({p, r, s});
    };
    if (is_closed) {
        add_quad(0.0, 0.0, 128.0, 128.0);
    } else {
        add_quad(0.0, 0.0, 128.0, a);
        add_quad(0.0, b, 128.0, 128.0);
        add_quad(0.0, a, a, b);
        add_quad(b, a, 128.0, b);
    }
    return scene;
}

}  // namespace terrane::test
