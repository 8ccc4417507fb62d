// SPDX-License-Identifier: MIT
#include "bodies/body_checks.h"

#include "math/vector_math.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kMaxPlace = 1e9;        // metres
constexpr double kMaxSpeed = 1e6;        // metres a second
constexpr double kMaxSpin = 1e6;         // radians a second
constexpr double kRotationSlack = 1e-6;  // of a rotation's columns from orthonormal

Result<void> check_rotation(const Eigen::Matrix3d& rotation) {
    for (int a = 0; a < 3; ++a) {
        const Eigen::Vector3d column = rotation.col(a);
        if (auto ok = check_vector("pose.rotation", column, 1.0 + kRotationSlack); !ok) return ok;
    }
    const double worst = column_error(rotation);
    const double det = determinant(rotation);
    if (worst <= kRotationSlack && det > 0.0) return {};
    return fail(ErrorCode::invalid_argument,
                "pose.rotation must be orthonormal with determinant 1, got determinant " +
                    number_text(det) + " and columns off by " + number_text(worst));
}

}  // namespace

Result<void> check_value(const char* name, double value, double low, double high,
                         const char* unit) {
    if (value >= low && value <= high) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be " + number_text(low) + " to " + number_text(high) +
                    (*unit == 0 ? "" : std::string(" ") + unit) + ", got " + number_text(value));
}

Result<void> check_fields(std::span<const FieldRange> fields) {
    for (const FieldRange& field : fields) {
        if (auto ok = check_value(field.name, field.value, field.low, field.high, field.unit);
            !ok) {
            return ok;
        }
    }
    return {};
}

Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit,
                          const char* unit) {
    static constexpr const char* kAxes[] = {".x", ".y", ".z"};
    for (int axis = 0; axis < 3; ++axis) {
        const std::string component = std::string(name) + kAxes[axis];
        if (auto ok = check_value(component.c_str(), value[axis], -limit, limit, unit); !ok) {
            return ok;
        }
    }
    return {};
}

Result<void> check_state(const BodyState& state) {
    if (auto ok = check_vector("pose.translation", state.pose.translation, kMaxPlace, "m"); !ok) {
        return ok;
    }
    if (auto ok = check_rotation(state.pose.rotation); !ok) return ok;
    if (auto ok = check_vector("velocity", state.velocity, kMaxSpeed, "m/s"); !ok) return ok;
    return check_vector("angular_velocity", state.angular_velocity, kMaxSpin, "rad/s");
}

}  // namespace terrane::internal
