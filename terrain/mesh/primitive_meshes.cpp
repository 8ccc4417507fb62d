// SPDX-License-Identifier: MIT
#include <terrane/base/text.h>
#include <terrane/terrain/primitive_meshes.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

namespace terrane {
namespace {

constexpr std::uint32_t kSegments = 32;    // around z
constexpr std::uint32_t kQuarter = 8;      // segments from the equator to a pole
constexpr double kLargestPrimitive = 1e5;  // metres

Result<void> check_size(const char* name, double value, bool may_be_zero) {
    const bool is_large_enough = may_be_zero ? value >= 0.0 : value > 0.0;
    if (is_large_enough && value <= kLargestPrimitive) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) +
                    (may_be_zero ? " must be 0 to 1e5 m, got "
                                 : " must be above 0 and at most 1e5 m, got ") +
                    number_text(value));
}

/// A ring of vertices about z; the normal lies in the half plane of the ring's angle.
struct Ring {
    double radius = 0.0, z = 0.0;              // metres
    double normal_out = 0.0, normal_up = 0.0;  // unit
    bool starts_face = false;  // whether the ring repeats the previous one with another normal
};

/// A surface of revolution about z through rings from bottom to top.
TriangleMesh make_round_mesh(const std::vector<Ring>& rings) {
    TriangleMesh mesh;
    for (const Ring& ring : rings) {
        for (std::uint32_t i = 0; i < kSegments; ++i) {
            const double angle = 2.0 * std::numbers::pi * i / kSegments;
            const double x = std::cos(angle), y = std::sin(angle);
            mesh.positions.emplace_back(ring.radius * x, ring.radius * y, ring.z);
            mesh.normals.push_back(
                Eigen::Vector3d(ring.normal_out * x, ring.normal_out * y, ring.normal_up)
                    .cast<float>());
        }
    }
    for (std::uint32_t k = 0; k + 1 < rings.size(); ++k) {
        if (rings[k + 1].starts_face) continue;
        const std::uint32_t below = k * kSegments, above = below + kSegments;
        for (std::uint32_t i = 0; i < kSegments; ++i) {
            const std::uint32_t next = (i + 1) % kSegments;
            if (rings[k].radius > 0.0)
                mesh.triangles.push_back({below + i, below + next, above + next});
            if (rings[k + 1].radius > 0.0)
                mesh.triangles.push_back({below + i, above + next, above + i});
        }
    }
    return mesh;
}

/// Rings of a half sphere about (0, 0, z), from bottom to top.
void add_half_sphere(double radius, double z, bool is_upper, std::vector<Ring>& rings) {
    for (std::uint32_t k = 0; k <= kQuarter; ++k) {
        const double share = static_cast<double>(is_upper ? k : kQuarter - k) / kQuarter;
        const double angle = 0.5 * std::numbers::pi * share;
        const bool is_pole = share == 1.0;  // exactly on the axis
        const double out = is_pole ? 0.0 : std::cos(angle);
        const double up = (is_upper ? 1.0 : -1.0) * (is_pole ? 1.0 : std::sin(angle));
        rings.push_back({radius * out, z + radius * up, out, up});
    }
}

}  // namespace

Result<TriangleMesh> make_box_mesh(const Eigen::Vector3d& half_extents) {
    for (const double each : half_extents) {
        TERRANE_TRY(check_size("half_extents", each, false));
    }
    TriangleMesh mesh;
    for (int axis = 0; axis < 3; ++axis) {
        for (const int side : {-1, 1}) {
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (int corner = 0; corner < 4; ++corner) {
                Eigen::Vector3d p;
                p[axis] = side;
                p[(axis + 1) % 3] = (corner & 1) != 0 ? 1.0 : -1.0;
                p[(axis + 2) % 3] = (corner & 2) != 0 ? side : -side;
                mesh.positions.emplace_back(p.cwiseProduct(half_extents));
                Eigen::Vector3f normal = Eigen::Vector3f::Zero();
                normal[axis] = static_cast<float>(side);
                mesh.normals.push_back(normal);
            }
            mesh.triangles.push_back({first, first + 1, first + 3});
            mesh.triangles.push_back({first, first + 3, first + 2});
        }
    }
    return mesh;
}

Result<TriangleMesh> make_sphere_mesh(double radius) { return make_capsule_mesh(radius, 0.0); }

Result<TriangleMesh> make_capsule_mesh(double radius, double half_height) {
    TERRANE_TRY(check_size("radius", radius, false));
    TERRANE_TRY(check_size("half_height", half_height, true));
    std::vector<Ring> rings;
    add_half_sphere(radius, -half_height, false, rings);
    if (half_height == 0.0) rings.pop_back();  // one equator
    add_half_sphere(radius, half_height, true, rings);
    return make_round_mesh(rings);
}

Result<TriangleMesh> make_cylinder_mesh(double radius, double half_height) {
    TERRANE_TRY(check_size("radius", radius, false));
    TERRANE_TRY(check_size("half_height", half_height, false));
    return make_round_mesh({{0.0, -half_height, 0.0, -1.0},
                            {radius, -half_height, 0.0, -1.0},
                            {radius, -half_height, 1.0, 0.0, true},
                            {radius, half_height, 1.0, 0.0},
                            {radius, half_height, 0.0, 1.0, true},
                            {0.0, half_height, 0.0, 1.0}});
}

}  // namespace terrane
