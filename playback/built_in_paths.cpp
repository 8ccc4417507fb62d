// SPDX-License-Identifier: MIT
//
// Source: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (targets of teleports).
#include "camera_legs.h"
#include "curve.h"
#include "ground_route.h"

#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace {

using Eigen::Vector2d;

constexpr double kPi = 3.141592653589793;
constexpr std::array<std::string_view, 6> kPathNames{"straight", "orbit", "canyon",
                                                     "turns",    "spins", "teleports"};

Vector2d middle(const WorldRect& extent) {
    return {0.5 * (extent.west + extent.east), 0.5 * (extent.south + extent.north)};
}

Vector2d longer_side(const WorldRect& extent) {
    return extent.east - extent.west >= extent.north - extent.south ? Vector2d(1.0, 0.0)
                                                                    : Vector2d(0.0, 1.0);
}

double longer_length(const WorldRect& extent) {
    return std::max(extent.east - extent.west, extent.north - extent.south);
}

// Rotates a vector by a small angle, with an error of angle^5 / 120. Avoids the C library's sin(), whose bits differ
// between systems.
Vector2d turned(const Vector2d& v, double angle) {
    const double half = 0.5 * angle;
    const double q = half * (1.0 + half * half / 3.0);  // tangent of half the angle
    const double cosine = (1.0 - q * q) / (1.0 + q * q);
    const double sine = 2.0 * q / (1.0 + q * q);
    return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y()};
}

LegPlan make_straight(const Vector2d& start, const Vector2d& direction, double speed,
                      double duration) {
    LegPlan plan;
    plan.duration = duration;
    plan.control.resize(control_count(duration));
    for (std::size_t i = 0; i < plan.control.size(); ++i) {
        const Vector2d p = start + speed * control_time(i) * direction;
        plan.control[i] = {p.x(), p.y(), 0.0};
    }
    return plan;
}

LegPlan make_straight(const PlanPlace& place, double speed, double duration) {
    const Vector2d direction = longer_side(place.region);
    if (place.start_world) return make_straight(*place.start_world, direction, speed, duration);
    const double used = std::min(speed * duration, 0.96 * longer_length(place.region));
    return make_straight(middle(place.region) - 0.5 * used * direction, direction, speed, duration);
}

LegPlan make_orbit(const HeightSource& source, const PlanPlace& place, double speed,
                   double duration) {
    constexpr double kLeast = 10.0;  // smallest radius, metres
    const WorldRect& region = place.region;
    const double limit = 0.3 * std::min(region.east - region.west, region.north - region.south);
    const double radius = std::max(kLeast, std::min(speed * duration / (2.0 * kPi), limit));
    LegPlan plan;
    plan.duration = duration;
    plan.control.resize(control_count(duration));
    Vector2d arm(0.0, -radius), first_arm = arm;
    for (std::size_t i = 0; i < plan.control.size(); ++i) {
        plan.control[i] = {arm.x(), arm.y(), 0.0};
        if (control_time(i) <= 0.0) first_arm = arm;
        arm = turned(arm, speed * kLegStep / radius);
    }
    const Vector2d centre =
        place.start_world ? Vector2d(*place.start_world - first_arm) : middle(region);
    for (Eigen::Vector3d& point : plan.control) {
        point = {centre.x() + point.x(), centre.y() + point.y(), 0.0};
    }
    plan.target_world = WorldPos(centre.x(), centre.y(), source.height(centre.x(), centre.y()));
    return plan;
}

// The plan, and all lines that it could have followed, its own first.
struct CanyonPlan {
    LegPlan plan;
    std::vector<std::vector<Vector2d>> lines;
};

Result<CanyonPlan> make_canyon(const HeightSource& source, const WorldRect& region, double speed,
                               double duration) {
    constexpr double kTurnTime = 8.0;  // seconds per turn: limits the curvature of fast paths
    CanyonPlan canyon;
    LegPlan& plan = canyon.plan;
    plan.duration = duration;
    plan.has_lean = true;
    const double length = speed * kLegStep * static_cast<double>(control_count(duration));
    TERRANE_TRY(canyon.lines, find_canyon_routes(source, region, length, kTurnTime * speed));
    for (const Vector2d& p : resampled(canyon.lines.front(), speed * kLegStep)) {
        plan.control.emplace_back(p.x(), p.y(), 0.0);
    }
    return canyon;
}

// Back and forth, with a left half circle at each end. By default the first straight is centred on the region.
LegPlan make_turns(const PlanPlace& place, double speed, double duration) {
    constexpr double kStraightTime = 5.0;  // seconds
    constexpr double kTurnTime = 6.0;      // seconds
    constexpr int kSubsteps = 16;
    constexpr double kSubstep = kLegStep / kSubsteps;
    const double straight_time = std::min(kStraightTime, 0.5 * longer_length(place.region) / speed);
    const auto angle = [straight_time](double time) {
        if (time <= 0.0) return 0.0;
        const double period = std::floor(time / (straight_time + kTurnTime));
        const double s =
            std::max(0.0, time - period * (straight_time + kTurnTime) - straight_time) / kTurnTime;
        // Smoothstep of degree 5: the turn rate and its derivative are 0 at both ends.
        return kPi * (period + s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
    };
    LegPlan plan;
    plan.duration = duration;
    plan.control.resize(control_count(duration));
    Vector2d direction = longer_side(place.region);
    const Vector2d from = place.start_world ? Vector2d(*place.start_world) : middle(place.region);
    const double before = place.start_world ? 0.0 : 0.5 * straight_time;
    Vector2d at = from - (before + kLegPad) * speed * direction;
    for (std::size_t i = 0; i < plan.control.size(); ++i) {
        plan.control[i] = {at.x(), at.y(), 0.0};
        for (int j = 0; j < kSubsteps; ++j) {
            const double time = control_time(i) + j * kSubstep;
            const double turn = angle(time + kSubstep) - angle(time);
            at += speed * kSubstep * turned(direction, 0.5 * turn);
            direction = turned(direction, turn);
        }
    }
    return plan;
}

// Heading, radians, of a view that makes a turn at 90 degrees/s, rests, then makes half a turn back and forward again.
double spin_angle(double time) {
    constexpr double kRate = 0.5 * kPi;
    constexpr double kRamp = 0.75;  // seconds to reach kRate, and to stop
    struct Part {
        double seconds, angle;
    };
    constexpr auto turn = [](double angle) {
        return Part{(angle < 0.0 ? -angle : angle) / kRate + kRamp, angle};
    };
    constexpr std::array<Part, 6> kParts{Part{1.0, 0.0}, turn(2.0 * kPi), Part{1.0, 0.0},
                                         turn(-kPi),     turn(kPi),       Part{0.75, 0.0}};
    double period = 0.0;
    for (const Part& part : kParts) period += part.seconds;
    if (time <= 0.0) return 0.0;
    // A period adds a whole turn, so all periods are the same.
    double left = time - std::floor(time / period) * period;
    double sum = 0.0;
    for (const Part& part : kParts) {
        if (left < part.seconds && part.angle != 0.0) {
            const double rest = part.seconds - left;
            const double rate = part.angle < 0.0 ? -kRate : kRate;
            if (left < kRamp) return sum + 0.5 * rate * left * left / kRamp;
            if (rest < kRamp) return sum + part.angle - 0.5 * rate * rest * rest / kRamp;
            return sum + rate * (left - 0.5 * kRamp);
        }
        if (left < part.seconds) return sum;
        left -= part.seconds;
        sum += part.angle;
    }
    return sum;
}

LegPlan make_spins(const PlanPlace& place, double speed, double duration) {
    constexpr double kStep = 1.0 / 32.0;
    LegPlan plan = make_straight(place, speed, duration);
    std::vector<Eigen::Vector3d> control;
    Vector2d arm(1.0, 0.0);
    double angle = 0.0;
    for (double time = 0.0; time <= duration + kStep; time += kStep) {
        const double next = spin_angle(time);
        // Between two periods the angle drops by a whole turn, which is no rotation.
        if (const double step = next - angle; std::abs(step) < kPi) arm = turned(arm, step);
        angle = next;
        control.emplace_back(arm.x(), arm.y(), 0.0);
    }
    plan.turn = SmoothCurve(0.0, kStep, std::move(control));
    return plan;
}

std::vector<LegPlan> make_teleports(const WorldRect& extent, double speed, double duration) {
    constexpr double kStay = 5.0;     // seconds
    constexpr double kInside = 0.7;   // share of the extent in which the centres of legs lie
    constexpr double kFarOff = 0.25;  // of the shorter side: least distance between successive legs
    const Vector2d size(extent.east - extent.west, extent.north - extent.south);
    const auto place = [&](int i) {
        const Vector2d share(0.5 + 0.7548776662466927 * i, 0.5 + 0.5698402909980532 * i);
        const Vector2d inside = share - share.array().floor().matrix() - Vector2d(0.5, 0.5);
        return Vector2d(middle(extent) + kInside * inside.cwiseProduct(size));
    };
    std::vector<LegPlan> legs;
    Vector2d direction = longer_side(extent);
    Vector2d centre = place(0);
    int next = 1;
    for (double start = 0.0; start < duration; start += kStay) {
        const double stay = std::min(kStay, duration - start);
        legs.push_back(
            make_straight(centre - 0.5 * speed * kStay * direction, direction, speed, stay));
        const Vector2d last = centre;
        do {
            centre = place(next++);
        } while ((centre - last).norm() < kFarOff * size.minCoeff());
        // Turns by about 106 degrees, so that headings practically never repeat.
        direction = {-0.28 * direction.x() - 0.96 * direction.y(),
                     0.96 * direction.x() - 0.28 * direction.y()};
    }
    return legs;
}

// Lays a plan, from its start on, over ground that can be climbed.
//
// @param lines that the plan could have followed: a canyon's; none if the plan may be moved as a whole
Result<void> lay_on_ground(const HeightSource& source, const PlanPlace& place, double speed,
                           const std::vector<std::vector<Vector2d>>& lines, LegPlan& plan) {
    constexpr double kNearStart = 40.0;  // metres, reach of a given start
    constexpr double kFarthest = 3.0;    // lengths of the path, reach of any other
    const auto start = static_cast<std::size_t>(kLegPad / kLegStep);
    const std::size_t count = plan.control.size();
    std::vector<Vector2d> line;
    for (std::size_t i = start; i < count; ++i) line.push_back(plan.control[i].head<2>());
    const double length = speed * plan.duration;
    const RouteFreedom freedom{
        .limits = *place.limits,
        .pivot = place.start_world ? Vector2d(*place.start_world) : middle(place.region),
        .reach = place.start_world ? std::min(kNearStart, length) : kFarthest * length,
        .is_fixed = !lines.empty()};
    std::vector<std::vector<Vector2d>> choices{line};
    for (const std::vector<Vector2d>& other : lines) {
        const std::vector<Vector2d> points = resampled(other, speed * kLegStep);
        choices.emplace_back(points.begin() + static_cast<std::ptrdiff_t>(start), points.end());
    }
    TERRANE_TRY(const auto route, lay_over_climbable_ground(choices, source, freedom));
    if (!route) return {};
    const double step = speed * kLegStep;
    line = resampled(extended(route->line, step * static_cast<double>(count)), step);
    for (std::size_t i = 0; i < count; ++i) {
        const Vector2d& p = line[count - start + i];
        plan.control[i] = {p.x(), p.y(), 0.0};
    }
    if (plan.target_world) {
        const Vector2d p = route->placement.moved(plan.target_world->head<2>());
        plan.target_world = WorldPos(p.x(), p.y(), source.height(p.x(), p.y()));
    }
    return {};
}

}  // namespace

std::span<const std::string_view> built_in_names() { return kPathNames; }

Result<std::vector<LegPlan>> plan_built_in(std::string_view name, const HeightSource& source,
                                           const PlanPlace& place, double speed, double duration) {
    if (name == "teleports") return make_teleports(place.region, speed, duration);
    std::vector<LegPlan> legs;
    std::vector<std::vector<Vector2d>> lines;
    if (name == "canyon") {
        TERRANE_TRY(CanyonPlan canyon, make_canyon(source, place.region, speed, duration));
        legs.push_back(std::move(canyon.plan));
        lines = std::move(canyon.lines);
    } else if (name == "orbit") {
        legs.push_back(make_orbit(source, place, speed, duration));
    } else if (name == "turns") {
        legs.push_back(make_turns(place, speed, duration));
    } else if (name == "spins") {
        legs.push_back(make_spins(place, speed, duration));
    } else {
        TERRANE_ASSERT(name == "straight", "the name must be one of the built-in paths'");
        legs.push_back(make_straight(place, speed, duration));
    }
    if (place.limits) {
        TERRANE_TRY(lay_on_ground(source, place, speed, lines, legs.front()));
    }
    return legs;
}

}  // namespace terrane::internal
