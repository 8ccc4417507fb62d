// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/simplify.h>

namespace terrane::internal {

/// Fails: invalid_argument, as simplify() says
Result<void> check_simplify_input(const SimplifyInput& input,
                                  std::span<const SimplifyLevel> levels);

}  // namespace terrane::internal
