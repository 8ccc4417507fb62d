// SPDX-License-Identifier: MIT
#include "collision/shapes/proxy_meshes.h"

#include <terrane/collision/shape_pairs.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace terrane::test {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

std::uint32_t index_of(std::size_t i) { return static_cast<std::uint32_t>(i); }

void append(const TriangleMesh& part, TriangleMesh& mesh) {
    const std::uint32_t first = index_of(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    for (const auto& t : part.triangles) {
        mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
}

/// A grid of quads that is closed along both directions.
TriangleMesh tube(std::size_t around, std::size_t across,
                  const std::function<Eigen::Vector3d(double)>& curve, double radius) {
    TriangleMesh mesh;
    for (std::size_t i = 0; i < around; ++i) {
        const double t = static_cast<double>(i) / static_cast<double>(around);
        const Eigen::Vector3d along = (curve(t + 1e-4) - curve(t - 1e-4)).normalized();
        const Eigen::Vector3d side = along.cross(Eigen::Vector3d::UnitZ()).normalized();
        const Eigen::Vector3d up = side.cross(along);
        for (std::size_t j = 0; j < across; ++j) {
            const double angle = kTurn * static_cast<double>(j) / static_cast<double>(across);
            mesh.positions.push_back(curve(t) +
                                     radius * (std::cos(angle) * side + std::sin(angle) * up));
        }
    }
    for (std::size_t i = 0; i < around; ++i) {
        for (std::size_t j = 0; j < across; ++j) {
            const auto at = [&](std::size_t a, std::size_t b) {
                return index_of((a % around) * across + b % across);
            };
            mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            mesh.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
        }
    }
    return mesh;
}

/// A surface of revolution about z. The profile lists radii and heights from the axis at the bottom to the axis at the
/// top.
TriangleMesh turned(std::span<const Eigen::Vector2d> profile, std::size_t around) {
    TriangleMesh mesh;
    const std::size_t rings = profile.size() - 2;
    for (std::size_t i = 1; i <= rings; ++i) {
        for (std::size_t j = 0; j < around; ++j) {
            const double angle = kTurn * static_cast<double>(j) / static_cast<double>(around);
            mesh.positions.emplace_back(profile[i].x() * std::cos(angle),
                                        profile[i].x() * std::sin(angle), profile[i].y());
        }
    }
    const std::uint32_t bottom = index_of(mesh.positions.size()), top = bottom + 1;
    mesh.positions.emplace_back(0.0, 0.0, profile.front().y());
    mesh.positions.emplace_back(0.0, 0.0, profile.back().y());
    const auto at = [&](std::size_t ring, std::size_t j) {
        return index_of(ring * around + j % around);
    };
    for (std::size_t j = 0; j < around; ++j) {
        mesh.triangles.push_back({bottom, at(0, j + 1), at(0, j)});
        mesh.triangles.push_back({top, at(rings - 1, j), at(rings - 1, j + 1)});
        for (std::size_t i = 0; i + 1 < rings; ++i) {
            mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            mesh.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
        }
    }
    return mesh;
}

}  // namespace

TriangleMesh prism_mesh(std::span<const Eigen::Vector2d> corners,
                        std::span<const TriangleMesh::Triangle> faces, double height) {
    TriangleMesh mesh;
    const std::size_t count = corners.size();
    for (const double z : {0.0, height}) {
        for (const Eigen::Vector2d& c : corners) mesh.positions.emplace_back(c.x(), c.y(), z);
    }
    const std::uint32_t up = index_of(count);
    for (const auto& t : faces) {
        mesh.triangles.push_back({t[0], t[2], t[1]});
        mesh.triangles.push_back({t[0] + up, t[1] + up, t[2] + up});
    }
    for (std::uint32_t i = 0; i < up; ++i) {
        const std::uint32_t next = (i + 1) % up;
        mesh.triangles.push_back({i, next, next + up});
        mesh.triangles.push_back({i, next + up, i + up});
    }
    return mesh;
}

TriangleMesh box_mesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const std::array<Eigen::Vector2d, 4> corners{
        {{low.x(), low.y()}, {high.x(), low.y()}, {high.x(), high.y()}, {low.x(), high.y()}}};
    const std::array<TriangleMesh::Triangle, 2> faces{{{0, 1, 2}, {0, 2, 3}}};
    TriangleMesh mesh = prism_mesh(corners, faces, high.z() - low.z());
    for (Eigen::Vector3d& p : mesh.positions) p.z() = p.z() > 0.0 ? high.z() : low.z();
    return mesh;
}

TriangleMesh l_mesh() {
    const std::array<Eigen::Vector2d, 6> corners{
        {{0.0, 0.0}, {2.0, 0.0}, {2.0, 1.0}, {1.0, 1.0}, {1.0, 2.0}, {0.0, 2.0}}};
    const std::array<TriangleMesh::Triangle, 4> faces{{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}};
    return prism_mesh(corners, faces, 1.0);
}

TriangleMesh star_mesh() {
    std::vector<Eigen::Vector2d> corners;
    std::vector<TriangleMesh::Triangle> faces;
    for (std::uint32_t i = 0; i < 10; ++i) {
        const double angle = kTurn * i / 10.0, radius = i % 2 == 0 ? 1.0 : 0.4;
        corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
        if (i % 2 == 0) faces.push_back({i, i + 1, (i + 9) % 10});
    }
    for (std::uint32_t i = 1; i < 4; ++i) faces.push_back({1, 2 * i + 1, 2 * i + 3});
    return prism_mesh(corners, faces, 0.3);
}

TriangleMesh torus_mesh(std::size_t around, std::size_t across, double large, double small) {
    return tube(
        around, across,
        [=](double t) {
            return Eigen::Vector3d(large * std::cos(kTurn * t), large * std::sin(kTurn * t), 0.0);
        },
        small);
}

TriangleMesh knot_mesh(std::size_t around, std::size_t across, double small) {
    return tube(
        around, across,
        [](double t) -> Eigen::Vector3d {
            const double a = kTurn * t;
            return Eigen::Vector3d(std::sin(a) + 2.0 * std::sin(2.0 * a),
                                   std::cos(a) - 2.0 * std::cos(2.0 * a), -std::sin(3.0 * a)) /
                   3.0;
        },
        small);
}

TriangleMesh bowl_mesh(std::size_t around) {
    std::vector<Eigen::Vector2d> profile;
    const std::size_t rings = around / 4;
    for (std::size_t i = 0; i <= rings; ++i) {
        const double a = 0.25 * kTurn * static_cast<double>(i) / static_cast<double>(rings);
        profile.emplace_back(std::sin(a), -std::cos(a));
    }
    for (std::size_t i = 0; i <= rings; ++i) {
        const double a = 0.25 * kTurn * static_cast<double>(rings - i) / static_cast<double>(rings);
        profile.emplace_back(0.8 * std::sin(a), -0.8 * std::cos(a));
    }
    return turned(profile, around);
}

TriangleMesh dumb_bell_mesh(std::size_t around) {
    std::vector<Eigen::Vector2d> profile;
    const std::size_t rings = around / 2;
    const double end = std::asin(0.15 / 0.5) / kTurn;  // of a turn, where a ball meets the rod
    for (const double side : {-1.0, 1.0}) {
        for (std::size_t i = 0; i <= rings; ++i) {
            const double share = static_cast<double>(i) / static_cast<double>(rings);
            const double a = kTurn * (0.5 - end) * (side < 0.0 ? share : 1.0 - share);
            profile.emplace_back(0.5 * std::sin(a), side * (0.7 + 0.5 * std::cos(a)));
        }
    }
    return turned(profile, around);
}

TriangleMesh rock_mesh(std::size_t around, double depth, std::uint64_t seed) {
    std::vector<Eigen::Vector2d> profile;
    const std::size_t rings = around / 2;
    for (std::size_t i = 0; i <= rings; ++i) {
        const double a = 0.5 * kTurn * static_cast<double>(i) / static_cast<double>(rings);
        profile.emplace_back(std::sin(a), -std::cos(a));
    }
    TriangleMesh mesh = turned(profile, around);
    std::mt19937_64 random(seed);
    for (Eigen::Vector3d& p : mesh.positions) {
        p *= 1.0 - depth * static_cast<double>(random() >> 11) * 0x1p-53;
    }
    return mesh;
}

TriangleMesh chair_mesh() {
    TriangleMesh mesh;
    append(box_mesh({0.0, 0.0, 0.4}, {0.5, 0.5, 0.45}), mesh);
    append(box_mesh({0.0, 0.45, 0.42}, {0.5, 0.5, 0.95}), mesh);
    for (const double x : {0.01, 0.44}) {
        for (const double y : {0.01, 0.44}) {
            append(box_mesh({x, y, 0.0}, {x + 0.05, y + 0.05, 0.42}), mesh);
        }
    }
    return mesh;
}

std::vector<NamedMesh> proxy_meshes() {
    return {{"l", l_mesh()},
            {"star", star_mesh()},
            {"chair", chair_mesh()},
            {"torus", torus_mesh(24, 12, 1.0, 0.3)},
            {"bowl", bowl_mesh(24)},
            {"dumb_bell", dumb_bell_mesh(24)},
            {"rock", rock_mesh(20, 0.2, 1)},
            {"knot", knot_mesh(60, 8, 0.15)}};
}

namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

double point_to_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& p) {
    const double square = (b - a).squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(b - a) / square, 0.0, 1.0) : 0.0;
    return (a + t * (b - a) - p).norm();
}

/// Random points on triangles, uniform by area.
class Sampler {
public:
    Sampler(const std::vector<Corners>& triangles, std::uint64_t seed)
        : triangles_(triangles), random_(seed) {
        for (const auto& [a, b, c] : triangles) {
            total_ += (b - a).cross(c - a).norm();
            areas_.push_back(total_);
        }
    }
    Eigen::Vector3d next() {
        const auto at = std::upper_bound(areas_.begin(), areas_.end(), unit() * total_);
        const std::size_t i =
            std::min(static_cast<std::size_t>(at - areas_.begin()), triangles_.size() - 1);
        double u = unit(), v = unit();
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        const auto& [a, b, c] = triangles_[i];
        return a + u * (b - a) + v * (c - a);
    }

private:
    double unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

    const std::vector<Corners>& triangles_;
    std::mt19937_64 random_;
    std::vector<double> areas_;
    double total_ = 0.0;
};

}  // namespace

double slow_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& p) {
    double least =
        std::min({point_to_segment(a, b, p), point_to_segment(b, c, p), point_to_segment(c, a, p)});
    // Interior of the triangle: solves the normal equations.
    const Eigen::Vector3d e = b - a, f = c - a, r = p - a;
    const double ee = e.dot(e), ef = e.dot(f), ff = f.dot(f), determinant = ee * ff - ef * ef;
    if (determinant > 0.0) {
        const double u = (ff * r.dot(e) - ef * r.dot(f)) / determinant;
        const double v = (ee * r.dot(f) - ef * r.dot(e)) / determinant;
        if (u >= 0.0 && v >= 0.0 && u + v <= 1.0)
            least = std::min(least, (r - u * e - v * f).norm());
    }
    return least;
}

double solid_angle_winding(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
    double sum = 0.0;
    for (const auto& t : mesh.triangles) {
        const Eigen::Vector3d a = mesh.positions[t[0]] - p, b = mesh.positions[t[1]] - p,
                              c = mesh.positions[t[2]] - p;
        const double x = a.norm(), y = b.norm(), z = c.norm();
        sum += 2.0 * std::atan2(a.dot(b.cross(c)),
                                x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
    }
    return sum / (4.0 * std::numbers::pi);
}

ProxyDistance measure_proxy(const TriangleMesh& mesh, const CollisionProxy& proxy,
                            std::size_t samples, std::uint64_t seed) {
    std::vector<Corners> of_mesh, of_proxy;
    for (const auto& t : mesh.triangles) {
        of_mesh.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
    }
    for (const CompoundPart& part : proxy.shape.parts()) {
        const auto& hull = std::get<ConvexHull>(part.shape);
        const auto v = hull.vertices();
        for (std::size_t face = 0; face < hull.face_count(); ++face) {
            const auto loop = hull.face(face);
            for (std::size_t i = 2; i < loop.size(); ++i) {
                of_proxy.push_back({v[loop[0]], v[loop[i - 1]], v[loop[i]]});
            }
        }
    }
    const bool is_solid = proxy.kind == CollisionProxyKind::hulls;
    ProxyDistance found;
    Sampler on_mesh(of_mesh, seed), on_proxy(of_proxy, seed + 1);
    for (std::size_t i = 0; i < samples; ++i) {
        const Pose at{Eigen::Matrix3d::Identity(), on_mesh.next()};
        found.mesh_to_proxy = std::max(found.mesh_to_proxy,
                                       signed_distance(Sphere{0.0}, at, proxy.shape, {}).distance);
        const Eigen::Vector3d p = on_proxy.next();
        double least = 1e300;
        for (const auto& [a, b, c] : of_mesh) least = std::min(least, slow_distance(a, b, c, p));
        if (least <= found.proxy_to_mesh) continue;
        if (is_solid && std::abs(solid_angle_winding(mesh, p)) > 0.5) continue;
        found.proxy_to_mesh = least;
    }
    return found;
}

}  // namespace terrane::test
