// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <terrane/volume/volume_shapes.h>

#include <string>

namespace terrane::tools {

/// A shape of a scene's volume and the word that scenes have for its kind.
struct SceneVolumeShape {
    std::string kind;  ///< sphere, capsule, box, hull, tube, mesh or vdb
    std::string file;  ///< of a mesh or vdb: its path; else ""
    VolumeShape shape;
};

/// Parses the shape of a volume; see read_volumes(). A hull becomes the closed mesh of its faces.
///
/// @param volume object with the key `shape`
/// @param path   of the volume: "volumes[2]"; errors begin with it
Parsed<SceneVolumeShape> read_volume_shape(const nlohmann::ordered_json& volume,
                                           const std::string& path, const std::string& folder);

}  // namespace terrane::tools
