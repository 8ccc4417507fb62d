// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <span>
#include <string>

// Checks of settings and states. All fail with invalid_argument, naming the field and its value.
namespace terrane::internal {

/// A field and its range.
struct FieldRange {
    const char* name;
    double value, low, high;
    const char* unit = "";  ///< of all three: "m"
};
Result<void> check_fields(std::span<const FieldRange> fields);
Result<void> check_value(const char* name, double value, double low, double high,
                         const char* unit = "");
/// @param limit of the absolute value of each component
Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit,
                          const char* unit = "");
Result<void> check_state(const BodyState& state);
/// "static", "kinematic" or "dynamic".
std::string to_string(BodyType type);
/// A body's settings, its state, and whether they go together.
Result<void> check_body(const BodySettings& settings, const BodyState& state);
Result<void> check_world(const WorldSettings& settings);

/// Largest component of a body's place, metres. A body that would move beyond it is parked.
inline constexpr double kMaxPlace = 2e9;
/// Largest component of a velocity, m/s.
inline constexpr double kMaxSpeed = 1e6;
/// Largest component of a spin, rad/s.
inline constexpr double kMaxSpin = 1e6;

}  // namespace terrane::internal
