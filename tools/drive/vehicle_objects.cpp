// SPDX-License-Identifier: MIT
#include "drive/vehicle_objects.h"

#include "world/body_objects.h"

#include <cmath>
#include <variant>

namespace terrane::tools {
namespace {

constexpr Colour kChassis{0.78f, 0.22f, 0.12f};
constexpr Colour kTrackedChassis{0.42f, 0.46f, 0.30f};
constexpr Colour kBodywork{0.85f, 0.80f, 0.72f};
constexpr Colour kTyre{0.15f, 0.15f, 0.15f};
constexpr Colour kSpokes{0.55f, 0.55f, 0.56f};
constexpr double kBeltWidth = 0.18;  // half width, metres
constexpr double kBeltHalf = 0.03;   // half thickness, metres

/// The sphere that touches ground and bodies, with a bar through it that shows the wheel's spin.
void add_wheel(const Eigen::Matrix3d& world_from_body, const WheelState& wheel, double radius,
               std::vector<DrawnObject>& objects) {
    Eigen::Matrix3d steered, spun;
    steered << std::cos(wheel.steer), -std::sin(wheel.steer), 0.0,  //
        std::sin(wheel.steer), std::cos(wheel.steer), 0.0,          //
        0.0, 0.0, 1.0;
    spun << std::cos(wheel.spin), 0.0, std::sin(wheel.spin),  //
        0.0, 1.0, 0.0,                                        //
        -std::sin(wheel.spin), 0.0, std::cos(wheel.spin);
    const Pose pose{world_from_body * steered * spun, wheel.centre_world};
    objects.push_back({DrawnObject::Form::ball, pose, Eigen::Vector3d::Constant(radius), kTyre});
    objects.push_back({DrawnObject::Form::box, pose,
                       Eigen::Vector3d(0.5 * radius, 0.9 * radius, 0.12 * radius), kSpokes});
}

/// A piece of belt between two wheels, above or below them.
void add_belt(const Pose& chassis, const WheelState& front, const WheelState& rear, double offset,
              std::vector<DrawnObject>& objects) {
    const Eigen::Vector3d left = chassis.rotation.col(1);
    const Eigen::Vector3d from = rear.centre_world + offset * chassis.rotation.col(2);
    const Eigen::Vector3d to = front.centre_world + offset * chassis.rotation.col(2);
    const Eigen::Vector3d along = (to - from).normalized();
    Pose pose;
    pose.rotation << along, left, along.cross(left);
    pose.translation = 0.5 * (from + to);
    objects.push_back({DrawnObject::Form::box, pose,
                       Eigen::Vector3d(0.5 * (to - from).norm() + kBeltHalf, kBeltWidth, kBeltHalf),
                       kTyre});
}

}  // namespace

void add_vehicle_objects(const VehicleSettings& settings, const VehicleState& state,
                         std::vector<DrawnObject>& objects) {
    const Pose& chassis = state.chassis.pose;
    objects.push_back({DrawnObject::Form::box, chassis, settings.chassis_half_extents,
                       settings.is_tracked ? kTrackedChassis : kChassis});
    for (const CompoundPart& part : settings.bodywork) {
        const Pose& own = part.body_from_part;
        const Pose world{chassis.rotation * own.rotation, chassis * own.translation};
        std::visit([&](const auto& shape) { add_objects(shape, world, kBodywork, objects); },
                   part.shape);
    }
    for (const WheelState& wheel : state.wheels) {
        add_wheel(chassis.rotation, wheel, settings.wheel_radius, objects);
    }
    if (!settings.is_tracked) return;
    const double offset = settings.wheel_radius - kBeltHalf;
    for (std::size_t i = 0; i + 2 < state.wheels.size(); ++i) {  // left and right take turns
        add_belt(chassis, state.wheels[i], state.wheels[i + 2], offset, objects);
        add_belt(chassis, state.wheels[i], state.wheels[i + 2], -offset, objects);
    }
}

}  // namespace terrane::tools
