// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground_batch.h>

namespace terrane::internal {

/// Fails: invalid_argument, naming the array and its length, where one is too short
Result<void> check_points(const char* name, const PointArray& points, bool has_heights);

/// Fails: invalid_argument, naming the array and its length, where an array has neither no entry nor `count`
Result<void> check_length(const char* name, std::size_t length, std::size_t count,
                          std::size_t per_item = 1);

}  // namespace terrane::internal
