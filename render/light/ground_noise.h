// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

namespace terrane::internal {

/// A repeating texture of smooth noise that varies the ground's tint and bumps: red and green hold
/// the slope, blue the value, all with mean 1/2. Mipmaps fade it out with distance.
GlTexture make_ground_noise();

}  // namespace terrane::internal
