// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <terrane/terrain/aabb.h>
#include <terrane/terrain/height_source.h>

#include <memory>
#include <string>
#include <vector>

namespace terrane::tools {

/// `volumes` of a scene. Opaque, so that the program can be built without terrane::volume, and then refuses them.
struct SceneVolumes;

/// Parses `volumes` of a scene: `[{"op":"remove"|"add","shape":V,"position":[x,y,z],"rotation":[w,x,y,z],
/// "voxel_m":v}..]` with V a convex shape as read_shape() takes it, `{"tube":{"path":[[x,y,z]..],"radius":r}}`,
/// `{"mesh":"file"}` or `{"vdb":"file"}`. op and shape are required. Errors begin with the path of the key:
/// "volumes[2].voxel_m must be".
///
/// @param folder that relative files are found from
Parsed<std::shared_ptr<const SceneVolumes>> read_volumes(const nlohmann::ordered_json& list,
                                                         const std::string& folder);

/// The finest voxel_m, metres.
double finest_voxel(const SceneVolumes& volumes);

/// A heightfield with the volumes, contoured at its finest level.
///
/// Fails: as Volumes::create(), naming the volume: "volumes[2]: the volume is"
Result<std::shared_ptr<const HeightSource>> add_volumes(std::shared_ptr<const HeightSource> heights,
                                                        const SceneVolumes& volumes);

/// One volume, for descriptions.
struct VolumeSummary {
    std::string op, shape;   ///< as in the scene
    double voxel_m = 0.0;    ///< as in the scene, metres
    Aabb bounds_world = {};  ///< metres
};
/// @param with the source that add_volumes() made
std::vector<VolumeSummary> list_volumes(const HeightSource& with, const SceneVolumes& volumes);

}  // namespace terrane::tools
