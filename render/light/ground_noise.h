// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

namespace terrane::internal {

/// A periodic noise texture for the tint and fine bumps of the ground: red and green are the slope, blue the value, all
/// with mean 1/2. Mipmaps fade it out with distance.
GlTexture make_ground_noise();

}  // namespace terrane::internal
