// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"

#include <terrane/terrain/height_source.h>

#include <memory>
#include <string>

namespace terrane {
class VolumeHeights;
}

namespace terrane::tools {

/// `volumes` of a scene. Opaque, like SceneVolumeField, so that the program can be built without terrane::volume.
struct SceneVolumes;

/// The volumes of a scene, placed and checked on the lattice of a ground.
struct SceneVolumeField;

/// Parses `volumes` of a scene:
/// `[{"op":"remove"|"add","shape":V,"position":[x,y,z],"rotation":[w,x,y,z],"voxel_m":v}..]` with V a sphere, capsule,
/// box or hull as for read_shape(), `{"tube":{"path":[[x,y,z]..],"radius":r}}`, `{"mesh":"file"}` (read_mesh()),
/// `{"vdb":"file"}` or `{"vdb":{"file":"file","grid":"name"}}`. Op, shape and position are required. Errors begin with
/// the path of the key: "volumes[2].voxel_m must be". Meshes are read here; null for an empty list.
///
/// Also fails for any non-empty list if the program was built without terrane::volume
///
/// @param folder base of relative paths
Parsed<std::shared_ptr<const SceneVolumes>> read_volumes(const nlohmann::ordered_json& list,
                                                         const std::string& folder);

/// The smallest voxel_m of the list, metres.
double finest_voxel(const SceneVolumes& volumes);

/// Places volumes on the finest level of a ground.
///
/// Fails: as Volumes::create(), and invalid_argument for a volume outside the ground's extent; messages begin with
///        "volumes[2]"
Result<std::shared_ptr<const SceneVolumeField>> place_volumes(const SceneVolumes& volumes,
                                                              const HeightSource& ground);

/// A ground joined with volumes, as VolumeHeights. `ground` must have the lattice on which the volumes were placed.
Result<std::shared_ptr<const HeightSource>> add_volumes(std::shared_ptr<const HeightSource> ground,
                                                        const SceneVolumeField& field);

/// A ground joined with volumes that a VolumeEditor can change; initially without volumes if `field` is null. Fails if
/// the program was built without terrane::volume.
Result<std::shared_ptr<VolumeHeights>> make_diggable(std::shared_ptr<const HeightSource> ground,
                                                     const SceneVolumeField* field);

/// The volumes in the output of `terrane info`, in their order: `[{"op":"remove","shape":"tube","voxel_m":v,
/// "bounds_m":[[x,y,z],[x,y,z]]}..]`. v is the spacing of the volume's contours. The bounds of a .vdb file are those of
/// its narrow band.
nlohmann::ordered_json describe_volumes(const SceneVolumeField& field);

}  // namespace terrane::tools
