// SPDX-License-Identifier: MIT
#include "scene/mesh/mesh_body.h"

#include "scene/mesh/mesh_reader.h"

#include <terrane/collision/collision_proxy.h>

#include <fmt/format.h>

#include <utility>
#include <variant>
#include <vector>

namespace terrane::tools {
namespace {

struct ScaledBy {
    double scale;

    Result<ConvexShape> operator()(const Sphere& sphere) const {
        return Sphere{scale * sphere.radius};
    }
    Result<ConvexShape> operator()(const Capsule& capsule) const {
        return Capsule{scale * capsule.radius, scale * capsule.half_height};
    }
    Result<ConvexShape> operator()(const Box& box) const { return Box{scale * box.half_extents}; }
    Result<ConvexShape> operator()(const ConvexHull& hull) const {
        std::vector<Eigen::Vector3d> vertices(hull.vertices().begin(), hull.vertices().end());
        for (Eigen::Vector3d& p : vertices) p *= scale;
        Result<ConvexHull> made = ConvexHull::create(vertices);
        if (!made) return tl::unexpected<Error>(made.error());
        return *std::move(made);
    }
};

}  // namespace

Result<Compound> make_mesh_body(const TriangleMesh& mesh, const std::string& file,
                                double proxy_error) {
    CollisionProxySettings settings;
    settings.proxy_error = proxy_error;
    settings.max_parts = 256;
    settings.max_hull_vertices = 256;
    settings.must_be_within_error = true;
    const Result<CollisionProxy> proxy = make_collision_proxy(mesh, settings);
    if (!proxy)
        return fail(proxy.error().code, fmt::format("'{}': {}", file, proxy.error().message));
    if (proxy->kind == CollisionProxyKind::open) {
        return fail(ErrorCode::bad_data,
                    fmt::format("'{}' is not closed: it has no inside to be a body", file));
    }
    if (proxy->kind == CollisionProxyKind::surface) {
        return fail(
            ErrorCode::bad_data,
            fmt::format("'{}' is not convex: as a body it needs a proxy error above 0", file));
    }
    if (!(default_contact_tolerance(proxy->shape) > 0.0)) {
        return fail(ErrorCode::bad_data, fmt::format("'{}' has parts without thickness", file));
    }
    return proxy->shape;
}

Result<Compound> scaled(const Compound& compound, double scale) {
    std::vector<CompoundPart> parts;
    for (const CompoundPart& part : compound.parts()) {
        Result<ConvexShape> shape = std::visit(ScaledBy{scale}, part.shape);
        if (!shape) return tl::unexpected<Error>(shape.error());
        Pose pose = part.body_from_part;
        pose.translation *= scale;
        parts.push_back({*std::move(shape), pose});
    }
    return Compound::create(parts);
}

Result<Shape> read_mesh_body(const std::string& path, double proxy_error, double scale) {
    Result<TriangleMesh> mesh = read_mesh(path);
    if (!mesh) return tl::unexpected<Error>(mesh.error());
    for (Eigen::Vector3d& p : mesh->positions) p *= scale;
    const Result<Compound> body = make_mesh_body(*mesh, path, proxy_error);
    if (!body) return tl::unexpected<Error>(body.error());
    return Shape(*body);
}

}  // namespace terrane::tools
