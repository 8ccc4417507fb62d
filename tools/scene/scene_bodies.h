// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"
#include "world/placed_body.h"

#include <string>
#include <vector>

namespace terrane::tools {

/// Parses `bodies` of a scene: `[{"shape":S,"position":[x,y,z],"rotation":[w,x,y,z],"velocity":[..],"spin":[..],
/// "type":"dynamic"|"static"|"kinematic","mass":m,"friction":f,"restitution":r}..]` with S as read_shape() takes it, or
/// `{"file":"rock.obj","proxy_error_m":0.02}` (read_mesh_body()).
/// Only shape and position are required; unknown keys are refused. Errors begin with the path of the key:
/// "bodies[2].mass must be".
///
/// @param folder of relative paths of files
Parsed<std::vector<PlacedBody>> read_bodies(const nlohmann::ordered_json& list,
                                            const std::string& folder = "");

}  // namespace terrane::tools
