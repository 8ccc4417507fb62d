// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>

// What settings and states of bodies must be. All fail with invalid_argument, naming the field and its value.
namespace terrane::internal {

Result<void> check_value(const char* name, double value, double low, double high);
/// @param limit of each component's size
Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit);
Result<void> check_state(const BodyState& state);

}  // namespace terrane::internal
