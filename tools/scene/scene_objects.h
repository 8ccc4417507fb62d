// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <terrane/terrain/scatter.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// A mesh that stands somewhere.
struct SceneObject {
    std::size_t mesh = 0;  ///< index of SceneObjects::meshes
    Pose world_from_object;
    double scale = 1.0;
    /// Of a collision proxy that bodies collide with, metres at scale 1; none: nothing collides.
    std::optional<double> proxy_error = {};
    std::size_t entry = 0;  ///< index in the scene's list
};

/// A mesh that is scattered over the ground.
struct SceneScatter {
    std::size_t mesh = 0;  ///< index of SceneObjects::meshes
    ScatterSettings settings;
    std::optional<double> proxy_error = {};  ///< as SceneObject::proxy_error
    std::size_t entry = 0;                   ///< index in the scene's list
};

/// `objects` of a scene.
struct SceneObjects {
    std::vector<TriangleMesh> meshes;
    std::vector<std::string> files;  ///< [meshes] where they were read from
    std::vector<std::string> names;  ///< [meshes] the files as the scene names them
    std::vector<SceneObject> objects;
    std::vector<SceneScatter> scatters;
};

/// Parses `objects` of a scene: a list of
/// `{"mesh":"file","position":[x,y,z],"rotation":[w,x,y,z],"scale":s,"static":b,"proxy_error_m":e}` and
/// `{"scatter":{"mesh":"file","per_km2":n,"slope_deg":[a,b],"height_m":[a,b],"scale":[a,b],"seed":k,
/// "static":b,"proxy_error_m":e}}`. Mesh, position and per_km2 are required. Files are read here, each once. Errors
/// begin with the path of the key: "objects[2].scatter.per_km2 must be".
///
/// @param folder that relative files are found from
Parsed<SceneObjects> read_objects(const nlohmann::ordered_json& list, const std::string& folder);

}  // namespace terrane::tools
