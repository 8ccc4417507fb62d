// SPDX-License-Identifier: MIT
#include "world/solver/body_checks.h"

#include "base/vector_math.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kRotationSlack = 1e-6;  // deviation of a rotation's columns from orthonormal

Result<void> check_rotation(const Eigen::Matrix3d& rotation) {
    for (int a = 0; a < 3; ++a) {
        const Eigen::Vector3d column = rotation.col(a);
        TERRANE_TRY(check_vector("pose.rotation", column, 1.0 + kRotationSlack));
    }
    const double worst = column_error(rotation);
    const double det = determinant(rotation);
    if (worst <= kRotationSlack && det > 0.0) return {};
    return fail(ErrorCode::invalid_argument,
                "pose.rotation must be orthonormal with determinant 1, got determinant " +
                    number_text(det) + " and columns off by " + number_text(worst));
}

Result<void> check_settings(const BodySettings& settings) {
    TERRANE_TRY(validate(settings.shape));
    TERRANE_TRY(check_value("mass", settings.mass, 1e-9, 1e12, "kg"));
    TERRANE_TRY(check_value("friction", settings.friction, 0.0, 1e6));
    TERRANE_TRY(check_value("restitution", settings.restitution, 0.0, 1.0));
    TERRANE_TRY(check_value("contact_tolerance", settings.contact_tolerance, 0.0, 1e3, "m"));
    if (settings.is_sensor && settings.type == BodyType::dynamic_body) {
        return fail(ErrorCode::invalid_argument,
                    "is_sensor must be false for a dynamic body, got true");
    }
    if (settings.contact_tolerance == 0.0 && !(default_contact_tolerance(settings.shape) > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "contact_tolerance must be given for a shape without thickness, got 0");
    }
    return {};
}

}  // namespace

std::string to_string(BodyType type) {
    switch (type) {
        case BodyType::static_body:
            return "static";
        case BodyType::kinematic_body:
            return "kinematic";
        case BodyType::dynamic_body:
            break;
    }
    return "dynamic";
}

Result<void> check_value(const char* name, double value, double low, double high,
                         const char* unit) {
    if (value >= low && value <= high) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be " + number_text(low) + " to " + number_text(high) +
                    (*unit == 0 ? "" : std::string(" ") + unit) + ", got " + number_text(value));
}

Result<void> check_fields(std::span<const FieldRange> fields) {
    for (const FieldRange& field : fields) {
        TERRANE_TRY(check_value(field.name, field.value, field.low, field.high, field.unit));
    }
    return {};
}

Result<void> check_vector(const char* name, const Eigen::Vector3d& value, double limit,
                          const char* unit) {
    static constexpr const char* kAxes[] = {".x", ".y", ".z"};
    for (int axis = 0; axis < 3; ++axis) {
        if (value[axis] >= -limit && value[axis] <= limit) continue;
        const std::string component = std::string(name) + kAxes[axis];
        TERRANE_TRY(check_value(component.c_str(), value[axis], -limit, limit, unit));
    }
    return {};
}

Result<void> check_state(const BodyPlacement& placement) {
    TERRANE_TRY(check_vector("pose.translation", placement.pose.translation, kMaxPlace, "m"));
    TERRANE_TRY(check_rotation(placement.pose.rotation));
    TERRANE_TRY(check_vector("velocity", placement.velocity, kMaxSpeed, "m/s"));
    return check_vector("angular_velocity", placement.angular_velocity, kMaxSpin, "rad/s");
}

Result<void> check_body(const BodySettings& settings, const BodyPlacement& placement) {
    TERRANE_TRY(check_settings(settings));
    TERRANE_TRY(check_state(placement));
    if (settings.type == BodyType::static_body) {
        TERRANE_TRY(check_vector("velocity of a static body", placement.velocity, 0.0, "m/s"));
    }
    if (settings.rotates && settings.type != BodyType::static_body) return {};
    return check_vector("angular_velocity of a body that does not rotate",
                        placement.angular_velocity, 0.0, "rad/s");
}

Result<void> check_substep(double max_substep) {
    return check_value("max_substep", max_substep, 1e-5, 1.0, "s");
}

Result<void> check_world(const WorldSettings& settings) {
    TERRANE_TRY(check_vector("gravity", settings.gravity, 1e4, "m/s^2"));
    TERRANE_TRY(check_substep(settings.max_substep));
    return check_value("worker_count", settings.worker_count, 1, 64);
}

}  // namespace terrane::internal
