// SPDX-License-Identifier: MIT
//
// Cuts a closed mesh into hulls, merges hulls while the distance stays within the error, and reduces their vertices.
#include "shapes/proxy_parts.h"
#include "shapes/query_shapes.h"

#include <terrane/base/text.h>
#include <terrane/collision/collision_proxy.h>
#include <terrane/terrain/simplify.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace terrane {
namespace {

using internal::ProxyPart;
using internal::SolidMesh;

/// Rounding of hulls, clipped points and dropped parts, relative to the extent: ConvexHull promises 1e-9, and the
/// containment test 1e-12 per dropped part.
constexpr double kHullRounding = 2e-9;

// Limits of the distance of omitted vertices from the reduced hull: kReduced times the error, and kThinned times the
// shortest side of the hull's box. The smaller limit applies.
constexpr double kReduced = 0.25;
constexpr double kThinned = 0.05;

Result<void> check_proxy_settings(const CollisionProxySettings& settings) {
    const auto wrong = [](const std::string& what, const std::string& got) {
        return fail(ErrorCode::invalid_argument,
                    "CollisionProxySettings::" + what + ", got " + got);
    };
    if (!(settings.proxy_error >= 0.0 && settings.proxy_error <= 1e6)) {
        return wrong("proxy_error must be 0 to 1e6", std::to_string(settings.proxy_error));
    }
    if (settings.max_parts < 1 || settings.max_parts > 4096) {
        return wrong("max_parts must be 1 to 4096", std::to_string(settings.max_parts));
    }
    if (settings.max_hull_vertices < 4 || settings.max_hull_vertices > 4096) {
        return wrong("max_hull_vertices must be 4 to 4096",
                     std::to_string(settings.max_hull_vertices));
    }
    return {};
}

/// Error for a proxy that cannot be within proxy_error.
tl::unexpected<Error> out_of_reach(const CollisionProxySettings& settings, const char* relation,
                                   double error) {
    return fail(ErrorCode::bad_data, "a proxy of " + number_text(settings.max_parts) +
                                         " hulls needs an error of " + relation + " " +
                                         number_text(error) + " m, got " +
                                         number_text(settings.proxy_error));
}

/// A proxy of the mesh's triangles, simplified within the error.
Result<CollisionProxy> make_surface(const SolidMesh& mesh, double error, CollisionProxyKind kind) {
    Result<std::vector<SimplifiedMesh>> levels =
        Result<std::vector<SimplifiedMesh>>(std::vector<SimplifiedMesh>{{mesh.triangles}});
    if (error > 0.0) {
        const SimplifyLevel level{.triangles = 0, .error_m = error};
        levels =
            simplify({.vertices = mesh.points, .triangles = mesh.triangles}, std::span(&level, 1));
        if (!levels) return tl::unexpected(levels.error());
    }
    const SimplifiedMesh& made = levels->front();
    TERRANE_TRY(Compound shape, Compound::from_triangles(mesh.points, made.triangles));
    const double distance = made.error_m + kHullRounding * mesh.extent;
    return CollisionProxy{.shape = std::move(shape),
                          .kind = kind,
                          .distance_m = distance,
                          .mesh_to_proxy_m = distance,
                          .proxy_to_mesh_m = distance,
                          .is_within_error = made.error_m <= error,
                          .mesh_volume = 0.0,
                          .parts_volume = 0.0};
}

/// Whether the solid is the whole hull: all triangles lie on the hull's faces, and their signed volume is not 0. A
/// closed surface on these faces has one winding number throughout the hull's interior.
bool is_whole_hull(const SolidMesh& mesh, const ConvexHull& hull, double volume) {
    if (!(std::abs(volume) > 0.5 * internal::volume_of(hull))) return false;
    const std::span<const internal::Polyhedron::Face> faces = internal::polyhedron(hull).faces;
    const double tolerance = 0.5 * kHullRounding * mesh.extent;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto corners = mesh.corners(i);
        const bool is_on_face = std::any_of(faces.begin(), faces.end(), [&](const auto& face) {
            return std::all_of(corners.begin(), corners.end(), [&](const Eigen::Vector3d& p) {
                return std::abs(internal::dot(face.normal, p) - face.offset) <= tolerance;
            });
        });
        if (!is_on_face) return false;
    }
    return true;
}

Result<CollisionProxy> make_solid(const SolidMesh& mesh, std::vector<ProxyPart> parts,
                                  const CollisionProxySettings& settings) {
    const double error = settings.proxy_error;
    double inside = 0.0, outside = 0.0, volume = 0.0;
    std::vector<CompoundPart> shapes;
    for (const ProxyPart& part : parts) {
        // Limited by the part's thickness, so that a part keeps a thickness, and thus a mass and a contact tolerance.
        const double thinnest = (part.bounds.high - part.bounds.low).minCoeff();
        const internal::ReducedHull reduced = internal::reduce_hull(
            part.hull, std::min(kReduced * error, kThinned * thinnest), settings.max_hull_vertices);
        inside = std::max(inside, reduced.distance);
        // The reduced hull lies inside the hull, so the smaller of the two bounds holds.
        double out = part.distance.high;
        if (out > 0.0) {
            const internal::HullDistance found = internal::distance_outside(
                mesh, reduced.hull, 0.0, std::max(0.02 * error, 1e-4 * mesh.extent),
                internal::kInfinity);
            out = std::min(out, found.high);
        }
        outside = std::max(outside, out);
        volume += internal::volume_of(reduced.hull);
        shapes.push_back({reduced.hull, {}});
    }
    if (settings.must_be_within_error && !(std::max(inside, outside) <= error))
        return out_of_reach(settings, "at least", std::max(inside, outside));
    TERRANE_TRY(Compound shape, Compound::create(shapes));
    const double rounding = kHullRounding * mesh.extent;
    return CollisionProxy{.shape = std::move(shape),
                          .kind = CollisionProxyKind::hulls,
                          .distance_m = std::max(inside, outside) + rounding,
                          .mesh_to_proxy_m = inside + rounding,
                          .proxy_to_mesh_m = outside + rounding,
                          .is_within_error = std::max(inside, outside) <= error,
                          .mesh_volume = std::abs(internal::signed_volume(mesh)),
                          .parts_volume = volume};
}

}  // namespace

Result<CollisionProxy> make_collision_proxy(const TriangleMesh& mesh,
                                            const CollisionProxySettings& settings) {
    TERRANE_TRY(check_proxy_settings(settings));
    TERRANE_TRY(mesh.validate());
    const SolidMesh solid = internal::make_solid_mesh(mesh);
    if (solid.triangles.empty()) {
        return fail(ErrorCode::invalid_argument,
                    "the mesh has no triangle with three different corners, of " +
                        std::to_string(mesh.triangles.size()));
    }
    if (!solid.is_closed) {
        return make_surface(solid, settings.proxy_error, CollisionProxyKind::open);
    }
    std::vector<Eigen::Vector3d> used;
    for (const SolidMesh::Triangle& t : solid.triangles) {
        for (const std::uint32_t corner : t) used.push_back(solid.points[corner]);
    }
    std::sort(used.begin(), used.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    });
    used.erase(std::unique(used.begin(), used.end()), used.end());
    TERRANE_TRY(ProxyPart whole, internal::make_part(used));
    if (is_whole_hull(solid, whole.hull, internal::signed_volume(solid))) {
        return make_solid(solid, {std::move(whole)}, settings);
    }
    if (!(settings.proxy_error > 0.0)) {
        return make_surface(solid, 0.0, CollisionProxyKind::surface);
    }
    TERRANE_TRY(std::vector<ProxyPart> cut,
                internal::cut_to_parts(solid, settings.proxy_error, 4 * settings.max_parts));
    if (settings.must_be_within_error) {
        const double least = internal::least_error(solid, cut);
        if (least > settings.proxy_error) return out_of_reach(settings, "more than", least);
    }
    TERRANE_TRY(
        std::vector<ProxyPart> merged,
        internal::merge_parts(solid, std::move(cut), settings.proxy_error, settings.max_parts));
    return make_solid(solid, std::move(merged), settings);
}

}  // namespace terrane
