// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/query_parsing.h"
#include "query/parsing/value_parsing.h"

namespace terrane::tools {

/// Parses a pick: `{"eye":[x,y,z],"look":[x,y,z],"fov_deg":60,"size":[w,h],"pixel":[x,y],"far_m":100000}`, named as the
/// flags of `terrane mesh`. In place of `look` there may be `forward`, a direction of any length. `up` is a direction
/// that is up in the picture, without it z, and north where the camera looks straight up or down. The pixel must be
/// within the picture, its edges included. fov_deg is 0.1 to 179, 60 where absent; far_m is above 0, at most 1e9.
Parsed<PickQuestion> read_pick(const nlohmann::ordered_json& object);

}  // namespace terrane::tools
