// SPDX-License-Identifier: MIT
#include "collision/proxy/proxy_oracle.h"

#include <terrane/collision/shape_pairs.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace terrane::test {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

double point_to_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& p) {
    const double square = (b - a).squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(b - a) / square, 0.0, 1.0) : 0.0;
    return (a + t * (b - a) - p).norm();
}

/// Random points of triangles, uniform by area.
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
    // Inside the triangle: the solution of the normal equations.
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
