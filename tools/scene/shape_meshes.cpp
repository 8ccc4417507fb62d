// SPDX-License-Identifier: MIT
#include "scene/shape_meshes.h"

#include <terrane/terrain/primitive_meshes.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace terrane::tools {
namespace {

using Rgba = std::array<std::uint8_t, 4>;

constexpr Rgba kBall{230, 115, 26, 255};
constexpr Rgba kCapsule{38, 115, 217, 255};
constexpr Rgba kBox{237, 230, 209, 255};
constexpr Rgba kStone{150, 140, 130, 255};

struct IsSame {
    bool operator()(const Sphere& a, const Sphere& b) const { return a.radius == b.radius; }
    bool operator()(const Capsule& a, const Capsule& b) const {
        return a.radius == b.radius && a.half_height == b.half_height;
    }
    bool operator()(const Box& a, const Box& b) const { return a.half_extents == b.half_extents; }
    bool operator()(const ConvexHull& a, const ConvexHull& b) const {
        return std::ranges::equal(a.vertices(), b.vertices());
    }
    bool operator()(const Compound& a, const Compound& b) const {
        return std::ranges::equal(
            a.parts(), b.parts(), [this](const CompoundPart& one, const CompoundPart& other) {
                return one.body_from_part.translation == other.body_from_part.translation &&
                       one.body_from_part.rotation == other.body_from_part.rotation &&
                       std::visit(*this, one.shape, other.shape);
            });
    }
    template <class A, class B>
    bool operator()(const A&, const B&) const {
        return false;
    }
};

TriangleMesh coloured(TriangleMesh mesh, const Rgba& colour) {
    mesh.colours.assign(mesh.positions.size(), colour);
    return mesh;
}

struct MeshOf {
    Result<TriangleMesh> operator()(const Sphere& sphere) const {
        TERRANE_TRY(TriangleMesh mesh, make_sphere_mesh(sphere.radius));
        return coloured(std::move(mesh), kBall);
    }
    Result<TriangleMesh> operator()(const Capsule& capsule) const {
        TERRANE_TRY(TriangleMesh mesh, make_capsule_mesh(capsule.radius, capsule.half_height));
        return coloured(std::move(mesh), kCapsule);
    }
    Result<TriangleMesh> operator()(const Box& box) const {
        TERRANE_TRY(TriangleMesh mesh, make_box_mesh(box.half_extents));
        return coloured(std::move(mesh), kBox);
    }
    Result<TriangleMesh> operator()(const ConvexHull& hull) const {
        const std::span<const Eigen::Vector3d> corners = hull.vertices();
        TriangleMesh mesh;
        for (std::size_t i = 0; i < hull.face_count(); ++i) {
            const std::span<const std::uint32_t> face = hull.face(i);
            // Newell's normal, which small and collinear edges do not spoil
            Eigen::Vector3d normal = Eigen::Vector3d::Zero();
            for (std::size_t k = 0; k < face.size(); ++k) {
                const Eigen::Vector3d& p = corners[face[k]];
                const Eigen::Vector3d& q = corners[face[(k + 1) % face.size()]];
                normal += (p - corners[face[0]]).cross(q - corners[face[0]]);
            }
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (const std::uint32_t corner : face) {
                mesh.positions.push_back(corners[corner]);
                mesh.normals.push_back(normal.normalized().cast<float>());
            }
            for (std::uint32_t k = 1; k + 1 < face.size(); ++k)
                mesh.triangles.push_back({first, first + k, first + k + 1});
        }
        if (mesh.triangles.empty())
            return fail(ErrorCode::invalid_argument, "a hull without faces cannot be drawn");
        return coloured(std::move(mesh), kStone);
    }
    Result<TriangleMesh> operator()(const Compound& compound) const {
        TriangleMesh all;
        for (const CompoundPart& part : compound.parts()) {
            TERRANE_TRY(const TriangleMesh mesh, std::visit(*this, part.shape));
            const auto first = static_cast<std::uint32_t>(all.positions.size());
            for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
                all.positions.push_back(part.body_from_part * mesh.positions[i]);
                all.normals.push_back(part.body_from_part.rotation.cast<float>() * mesh.normals[i]);
            }
            all.colours.insert(all.colours.end(), mesh.colours.begin(), mesh.colours.end());
            for (const TriangleMesh::Triangle& corners : mesh.triangles) {
                all.triangles.push_back(
                    {first + corners[0], first + corners[1], first + corners[2]});
            }
        }
        return all;
    }
};

}  // namespace

bool is_same_shape(const Shape& a, const Shape& b) { return std::visit(IsSame(), a, b); }

Result<TriangleMesh> make_shape_mesh(const Shape& shape) { return std::visit(MeshOf(), shape); }

}  // namespace terrane::tools
