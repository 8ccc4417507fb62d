// SPDX-License-Identifier: MIT
//
// Poses of wheels and tracks. A belt is the convex hull of the circles of a track's wheels and sprockets, seen from the
// side: arcs on circles, and the tangents between them. The hull is found by turning a direction once around: from the
// circle with the largest support in that direction, the next circle is the one whose support first gets larger.
#include "scene/running_gear.h"
#include "scene/vehicle_forms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>

namespace terrane::tools {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kGravity = 9.81;

struct Circle {
    Eigen::Vector2d centre;  // x and z
    double radius = 0.0;
};

Eigen::Vector2d direction(double angle) { return {std::cos(angle), std::sin(angle)}; }

/// The boundary of the convex hull of circles, counter-clockwise with x to the right and z up.
class Belt {
public:
    explicit Belt(std::span<const Circle> circles) {
        const auto support = [&](const Circle& c, double angle) {
            return c.centre.dot(direction(angle)) + c.radius;
        };
        double angle = 0.0;
        std::size_t current = 0;
        for (std::size_t i = 1; i < circles.size(); ++i) {
            if (support(circles[i], angle) > support(circles[current], angle)) current = i;
        }
        const std::size_t most = 4 * circles.size() + 4;
        for (std::size_t step = 0; step < most && angle < kTurn; ++step) {
            const Circle& own = circles[current];
            double next_angle = kTurn;
            std::size_t next = current;
            for (std::size_t i = 0; i < circles.size(); ++i) {
                const Eigen::Vector2d to = circles[i].centre - own.centre;
                const double cosine = (own.radius - circles[i].radius) / to.norm();
                if (i == current || !(std::abs(cosine) < 1.0)) continue;  // one in the other
                double meets = std::atan2(to.y(), to.x()) - std::acos(cosine);
                meets -= kTurn * std::floor((meets - angle) / kTurn);  // angle to angle + kTurn
                if (meets - angle > kTurn - 1e-9) meets = angle;
                if (meets < next_angle) {
                    next_angle = meets;
                    next = i;
                }
            }
            add(own.centre, own.radius, angle, next_angle);
            if (next != current) {
                const Eigen::Vector2d from = own.centre + own.radius * direction(next_angle);
                const Eigen::Vector2d to =
                    circles[next].centre + circles[next].radius * direction(next_angle);
                add_line(from, to, next_angle);
            }
            angle = next_angle;
            current = next;
        }
    }

    double length() const { return length_; }

    /// The point at a distance along the belt, which is taken modulo its length.
    Eigen::Vector2d at(double along) const {
        along -= length_ * std::floor(along / length_);
        const auto after =
            std::upper_bound(pieces_.begin(), pieces_.end(), along,
                             [](double value, const Piece& piece) { return value < piece.start; });
        const Piece& piece = after == pieces_.begin() ? pieces_.front() : *std::prev(after);
        const double within = along - piece.start;
        if (piece.radius > 0.0)
            return piece.from + piece.radius * direction(piece.angle + within / piece.radius);
        return piece.from + within * Eigen::Vector2d(-std::sin(piece.angle), std::cos(piece.angle));
    }

private:
    struct Piece {
        double start = 0.0;                              // metres along the belt
        Eigen::Vector2d from = Eigen::Vector2d::Zero();  // centre of an arc, start of a line
        double radius = 0.0;                             // 0: a line
        double angle = 0.0;                              // of the outward normal at the start
    };

    void add(const Eigen::Vector2d& centre, double radius, double from, double to) {
        if (to <= from) return;
        pieces_.push_back({length_, centre, radius, from});
        length_ += radius * (to - from);
    }
    void add_line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double angle) {
        pieces_.push_back({length_, from, 0.0, angle});
        length_ += (to - from).norm();
    }

    std::vector<Piece> pieces_;
    double length_ = 0.0;
};

/// The circles of the belt's middle line around wheels at given places, x and z.
std::vector<Circle> circles_of(const VehicleSettings& settings, const VehicleLayout& layout,
                               std::span<const Eigen::Vector2d> wheels) {
    // the ground is under the middle of the belt: wheels touch it without their belt
    std::vector<Circle> circles;
    for (const Eigen::Vector2d& wheel : wheels)
        circles.push_back({wheel, settings.wheel_radius - 0.5 * layout.belt_thickness});
    for (const Eigen::Vector2d& sprocket : {layout.front_sprocket, layout.rear_sprocket})
        circles.push_back({sprocket, layout.sprocket_radius + 0.5 * layout.belt_thickness});
    return circles;
}

/// World pose of something whose axle is the chassis's y: spun, and turned to the right side.
Eigen::Matrix3d spun(double spin, bool is_right) {
    Eigen::Matrix3d about_y, about_z;
    about_y << std::cos(spin), 0.0, std::sin(spin), 0.0, 1.0, 0.0, -std::sin(spin), 0.0,
        std::cos(spin);
    about_z << -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0;
    return is_right ? Eigen::Matrix3d(about_y * about_z) : about_y;
}

/// The wheels of one side in the chassis's frame, x and z, and their mean spin.
struct SideWheels {
    std::vector<Eigen::Vector2d> places;
    double spin = 0.0;
};

SideWheels wheels_of(const VehicleSettings& settings, const VehicleState& state, bool is_right) {
    SideWheels side;
    const Pose& chassis = state.chassis.pose;
    std::size_t wheel = 0;
    for (const AxleSettings& axle : settings.axles) {
        if (axle.track > 0.0) {
            const WheelState& own = state.wheels[wheel + (is_right ? 1 : 0)];
            const Eigen::Vector3d place =
                chassis.rotation.transpose() * (own.centre_world - chassis.translation);
            side.places.emplace_back(place.x(), place.z());
            side.spin += own.spin;
        }
        wheel += axle.track > 0.0 ? 2 : 1;
    }
    side.spin /= static_cast<double>(std::max<std::size_t>(side.places.size(), 1));
    return side;
}

}  // namespace

VehicleLayout::VehicleLayout(const VehicleSettings& settings) {
    const double radius = settings.wheel_radius;
    rest = radius - settings.centre_of_mass_height;
    const double rate = kTurn * settings.suspension_hertz;
    rise =
        settings.suspension_travel - std::min(settings.suspension_travel, kGravity / (rate * rate));
    double sum = 0.0, least = std::numeric_limits<double>::infinity();
    std::vector<Eigen::Vector2d> wheels;
    for (const AxleSettings& axle : settings.axles) {
        if (axle.track <= 0.0) continue;
        sum += axle.track;
        least = std::min(least, axle.track);
        wheels.emplace_back(axle.position, rest);
    }
    wheel_width = std::min({0.6 * radius, 0.8 * least, 0.6 * settings.chassis_half_extents.y()});
    if (!settings.is_tracked || wheels.empty()) return;

    belt_width = std::min({0.95 * radius, 0.8 * least, 0.6 * settings.chassis_half_extents.y()});
    wheel_width = 0.8 * belt_width;
    belt_thickness = 0.1 * radius;
    track_side = 0.5 * sum / static_cast<double>(wheels.size());
    sprocket_radius = 0.55 * radius;
    const auto [rear, front] = std::minmax_element(
        wheels.begin(), wheels.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
    const Eigen::Vector2d from_wheel(1.25 * radius, 0.85 * radius);
    front_sprocket = *front + from_wheel;
    rear_sprocket = *rear + Eigen::Vector2d(-from_wheel.x(), from_wheel.y());
    constexpr double kPitch = 0.36;  // relative to the wheels' radius
    const double length = Belt(circles_of(settings, *this, wheels)).length();
    link_count = static_cast<std::size_t>(std::lround(length / (kPitch * radius)));
    link_length = length / static_cast<double>(link_count);
}

Pose wheel_pose(const VehicleSettings& settings, const VehicleState& state, std::size_t wheel) {
    std::size_t first = 0;  // wheel of its axle
    bool is_right = false;
    for (const AxleSettings& axle : settings.axles) {
        const std::size_t count = axle.track > 0.0 ? 2 : 1;
        if (wheel < first + count) {
            is_right = wheel > first;
            break;
        }
        first += count;
    }
    const WheelState& own = state.wheels[wheel];
    Eigen::Matrix3d steered;
    steered << std::cos(own.steer), -std::sin(own.steer), 0.0, std::sin(own.steer),
        std::cos(own.steer), 0.0, 0.0, 0.0, 1.0;
    return {state.chassis.pose.rotation * steered * spun(own.spin, is_right), own.centre_world};
}

std::vector<Pose> track_link_poses(const VehicleSettings& settings, const VehicleState& state) {
    const VehicleLayout layout(settings);
    std::vector<Pose> poses;
    if (layout.link_count == 0) return poses;
    const Pose& chassis = state.chassis.pose;
    for (const bool is_right : {false, true}) {
        const SideWheels wheels = wheels_of(settings, state, is_right);
        const Belt belt(circles_of(settings, layout, wheels.places));
        const double spacing = belt.length() / static_cast<double>(layout.link_count);
        // above the wheels the belt runs forward, which is clockwise
        const double travel = -wheels.spin * settings.wheel_radius;
        const double side = is_right ? -layout.track_side : layout.track_side;
        for (std::size_t k = 0; k < layout.link_count; ++k) {
            const double along = travel + spacing * static_cast<double>(k);
            const Eigen::Vector2d from = belt.at(along), to = belt.at(along + spacing);
            const Eigen::Vector2d tangent = (to - from).normalized();
            Pose link;
            link.rotation.col(0) = Eigen::Vector3d(tangent.x(), 0.0, tangent.y());
            link.rotation.col(2) = Eigen::Vector3d(tangent.y(), 0.0, -tangent.x());
            link.rotation.col(1) = link.rotation.col(2).cross(link.rotation.col(0));
            const Eigen::Vector2d middle = 0.5 * (from + to);
            poses.push_back({chassis.rotation * link.rotation,
                             chassis * Eigen::Vector3d(middle.x(), side, middle.y())});
        }
    }
    return poses;
}

std::vector<Pose> sprocket_poses(const VehicleSettings& settings, const VehicleState& state) {
    const VehicleLayout layout(settings);
    std::vector<Pose> poses;
    if (layout.link_count == 0) return poses;
    const Pose& chassis = state.chassis.pose;
    const double ratio = settings.wheel_radius / layout.sprocket_radius;
    for (const Eigen::Vector2d& place : {layout.front_sprocket, layout.rear_sprocket}) {
        for (const bool is_right : {false, true}) {
            const double side = is_right ? -layout.track_side : layout.track_side;
            const double spin = ratio * wheels_of(settings, state, is_right).spin;
            poses.push_back({chassis.rotation * spun(spin, is_right),
                             chassis * Eigen::Vector3d(place.x(), side, place.y())});
        }
    }
    return poses;
}

}  // namespace terrane::tools
