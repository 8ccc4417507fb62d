// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>

#include <span>

// What settings and states of bodies must be. All fail with invalid_argument, naming the field and its value.
namespace terrane::internal {

/// What a number must be.
struct FieldRange {
    const char* name;
    double value, low, high;
    const char* unit = "";  ///< of all three: "m"
};
Result<void> check_fields(std::span<const FieldRange> fields);
Result<void> check_value(const char* name, double value, double low, double high,
                         const char* unit = "");
/// @param limit of each component's size
Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit,
                          const char* unit = "");
Result<void> check_state(const BodyState& state);

}  // namespace terrane::internal
