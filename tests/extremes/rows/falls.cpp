// SPDX-License-Identifier: MIT
#include "extremes/rows/falls.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::extremes {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

double tolerance_of(const BodySettings& settings) {
    return settings.contact_tolerance > 0.0 ? settings.contact_tolerance
                                            : default_contact_tolerance(settings.shape);
}

/// Adds the bodies; false where one is refused or has no ground below.
bool add_bodies(World& world, const Ground& ground, const Fall& fall) {
    double x = fall.x;
    for (const Shape& shape : fall.shapes) {
        const double radius = bounding_radius(shape);
        BodyState state = at_place(x, fall.y, 0.0);
        const LiftAnswer lift = compute_lift(shape, state.pose, ground);
        if (lift.status != QueryStatus::complete || !std::isfinite(lift.lift)) return false;
        state.pose.translation.z() = lift.lift + fall.gap;
        state.velocity = fall.velocity;
        if (!world.add({.shape = shape, .restitution = 0.0}, state)) return false;
        x += 2.0 * radius + fall.gap;
    }
    return true;
}

}  // namespace

std::vector<Shape> shapes_of_size(double size) {
    std::vector<Eigen::Vector3d> corners{{-0.9, -0.6, -0.3}, {1.0, -0.7, -0.4}, {0.8, 0.9, -0.3},
                                         {-0.7, 0.8, -0.4},  {-0.5, 0.1, 0.9},  {0.3, 0.4, 0.7}};
    for (Eigen::Vector3d& corner : corners) corner *= size;
    CompoundPart head{Box{size * Eigen::Vector3d(0.3, 0.8, 0.3)}, {}};
    head.body_from_part.translation = size * Eigen::Vector3d(0.7, 0.1, 0.1);
    CompoundPart handle{Capsule{size * 0.25, size * 0.5}, {}};
    handle.body_from_part.rotation << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
    return {Sphere{size}, Capsule{0.4 * size, 0.6 * size},
            Box{size * Eigen::Vector3d(1.0, 0.7, 0.5)}, ConvexHull::create(corners).value(),
            Compound::create(std::vector<CompoundPart>{head, handle}).value()};
}

double depth_share(const Ground& ground, const BodySettings& settings, const BodyState& state) {
    if (!state.pose.translation.allFinite() || !state.velocity.allFinite()) return kNan;
    const DistanceAnswer answer = signed_distance(settings.shape, state.pose, ground, 0.0);
    if (answer.status != QueryStatus::complete) return kInfinite;
    return std::max(0.0, -answer.distance) / tolerance_of(settings);
}

double worst_depth_share(const Ground& ground, const Fall& fall) {
    Result<World> world = World::create({.max_substep = fall.max_substep});
    if (!world || !add_bodies(*world, ground, fall)) return kNan;
    double worst = 0.0;
    for (int i = 0; i < fall.steps; ++i) {
        const StepReport report = world->step(ground, fall.dt);
        if (report.parked > 0 || report.refused_steps > 0 || report.too_deep > 0) return kInfinite;
        for (std::size_t body = 0; body < world->states().size(); ++body) {
            const double share =
                depth_share(ground, world->settings()[body], world->states()[body]);
            if (!(share <= worst)) worst = share;  // keeps NaN
            if (!(share <= kInfinite)) return share;
        }
    }
    return worst;
}

BodyState at_place(double x, double y, double z) {
    BodyState state;
    state.pose.translation = {x, y, z};
    return state;
}

}  // namespace terrane::extremes
