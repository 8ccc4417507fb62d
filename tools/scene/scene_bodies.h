// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"
#include "scene/scene_nodes.h"

#include <terrane/base/result.h>
#include <terrane/collision/shapes.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// A body and its state at the start of a run.
struct PlacedBody {
    BodySettings settings;
    BodyState state;
    std::string mesh_file = {};  ///< path of the mesh that pictures show; "": its shape
    /// Nodes of all bodies of the scene; null: pictures show the mesh file or the shape.
    std::shared_ptr<const SceneNodes> nodes = {};
    std::size_t node = 0;  ///< index in `nodes` of the one that pictures show, in the body's frame
};

/// Adds bodies to a world, in order. Fails as World::add().
Result<std::vector<BodyId>> add_bodies(std::span<const PlacedBody> bodies, World& world);

/// Whether a shape touches no body of a world.
bool is_free(const World& world, const Ground& ground, const Shape& shape,
             const Pose& world_from_shape);

/// Default error of the collision proxy of a body from a mesh file, metres.
inline constexpr double kUsualProxyError = 0.02;

/// A body's shape from a mesh: the hulls of make_collision_proxy().
///
/// @param file        path of the mesh, for messages
/// @param proxy_error largest error of the hulls, metres
///
/// Fails: as make_collision_proxy(); bad_data if the mesh is not closed or has no thickness, or if the hulls do not
///        reach the error. The message names the file
Result<Compound> make_mesh_body(const TriangleMesh& mesh, const std::string& file,
                                double proxy_error);

/// A uniformly scaled compound.
///
/// @param scale factor of the sizes and positions of the parts, > 0
///
/// Fails: as Compound::create(), for scaled sizes out of range
Result<Compound> scaled(const Compound& compound, double scale);

/// A body's shape from a mesh file.
///
/// @param scale       multiplies the file's points
/// @param proxy_error largest error of the hulls after scaling, metres
///
/// Fails: as read_mesh() and make_mesh_body()
Result<Shape> read_mesh_body(const std::string& path, double proxy_error, double scale = 1.0);

/// Parses `bodies` of a scene: `[{"shape":S,"position":[x,y,z],"rotation":[w,x,y,z],"velocity":[..],"spin":[..],
/// "type":"dynamic"|"static"|"kinematic","mass":m,"friction":f,"restitution":r,"node":N}..]`: S as for read_shape() or
/// `{"file":"rock.obj","proxy_error_m":0.02}` (read_mesh_body()), N as for read_body_nodes(). Only shape and position
/// are required; unknown keys are refused. Errors begin with the path of the key: "bodies[2].mass must be".
///
/// @param folder base of relative paths
Parsed<std::vector<PlacedBody>> read_bodies(const nlohmann::ordered_json& list,
                                            const std::string& folder = "");

}  // namespace terrane::tools
