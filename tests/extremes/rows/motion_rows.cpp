// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace terrane::extremes {
namespace {

constexpr const char* kDepthPromise =
    "No body is deeper in the contact surface than its contact_tolerance, or passes through it.";
constexpr const char* kDepthFigure = "largest depth / contact_tolerance over all steps";

/// The ground that rows of this file share.
const Ground& hills() {
    static const Source source = make_hills({}).value();
    static const Ground ground = load(*source).value();
    return ground;
}

/// Why a world refuses a body of this state.
std::string refusal_of(const BodyState& state) {
    return message_of(World::create({}).value().add({}, state));
}

ExtremeRow speed_row() {
    ExtremeRow row{.name = "Speed",
                   .topic = "Speeds",
                   .swept = "speed of bodies towards the ground, m/s",
                   .promise = kDepthPromise,
                   .figure = kDepthFigure,
                   .values = {0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5}};
    row.measure = [](double speed) {
        return worst_depth_share(
            hills(), {.shapes = shapes_of_size(0.5), .gap = 0.5, .velocity = {0.0, 0.0, -speed}});
    };
    row.refusal = [](double speed) {
        BodyState state;
        state.velocity.z() = -speed;
        return refusal_of(state);
    };
    row.ends = {{1e4, 1e300, false, "velocity.z"}};
    return row;
}

ExtremeRow oblique_speed_row() {
    ExtremeRow row = speed_row();
    row.name = "SpeedAlongTheGround";
    row.swept = "speed of bodies along steep hills and down, m/s";
    row.measure = [](double speed) {
        const Result<Source> steep =
            make_hills({.side = 1024.0, .amplitude = 30.0, .wavelength = 24.0});
        const Result<Ground> ground = load(**steep);
        if (!ground) return kNan;
        return worst_depth_share(*ground, {.shapes = shapes_of_size(0.5),
                                           .x = -500.0,
                                           .gap = 0.5,
                                           .velocity = {speed, 0.3 * speed, -0.2 * speed}});
    };
    return row;
}

ExtremeRow long_substep_row() {
    ExtremeRow row = speed_row();
    row.name = "SpeedInLongSubsteps";
    row.swept = "speed of bodies towards the ground in one step of a second, m/s";
    row.measure = [](double speed) {
        return worst_depth_share(hills(), {.shapes = shapes_of_size(0.5),
                                           .gap = 0.5,
                                           .velocity = {0.0, 0.0, -speed},
                                           .dt = 1.0,
                                           .steps = 2,
                                           .max_substep = 1.0});
    };
    return row;
}

ExtremeRow step_row() {
    ExtremeRow row{.name = "StepLength",
                   .topic = "Steps",
                   .swept = "dt, s",
                   .promise = kDepthPromise,
                   .figure = kDepthFigure,
                   .values = {1e-6, 1e-5, 1e-4, 1e-3, 1.0 / 60.0, 0.1, 1.0, 10.0}};
    row.measure = [](double dt) {
        const double steps = std::clamp(0.5 / dt, 2.0, 2000.0);
        // Half of the time to the first impact, half of it in contact.
        return worst_depth_share(hills(), {.shapes = shapes_of_size(0.5),
                                           .gap = std::min(0.5, 5.0 * dt * steps),
                                           .velocity = {0.0, 0.0, -10.0},
                                           .dt = dt,
                                           .steps = static_cast<int>(steps)});
    };
    row.refusal = [](double dt) -> std::string {
        World world = World::create({}).value();
        return world.step(hills(), dt).refused_steps > 0
                   ? "StepReport::refused_steps is 1, and nothing moves"
                   : "";
    };
    row.ends = {{1e-6, 0.0, false, "refused_steps"}, {1.0, 1e300, false, "refused_steps"}};
    return row;
}

/// The gap at the reported time of contact over the tolerance, the largest of all shapes; infinite for an overlap.
double cast_gap_share(double length) {
    double worst = 0.0;
    for (const Shape& shape : shapes_of_size(0.5)) {
        Motion motion;
        motion.start = at_place(0.3, 0.7, 20.0 + 0.5 * length).pose;
        motion.translation = {0.1 * length, 0.05 * length, -length};
        // Aimed at the origin's hills from wherever half of the motion begins.
        motion.start.translation -= 0.5 * Eigen::Vector3d(0.1 * length, 0.05 * length, 0.0);
        const CastSettings settings;
        const CastAnswer answer = cast(shape, motion, hills(), settings);
        if (answer.status != QueryStatus::ok || !answer.hit) return kNan;
        const DistanceAnswer gap = signed_distance(shape, motion.at(answer.fraction), hills(), 1.0);
        // The pose at the reported time is rounded.
        if (gap.distance < -1e-9 - 0x1p-52 * length) return kInfinite;
        worst = std::max(worst, gap.distance / settings.tolerance);
    }
    return worst;
}

ExtremeRow cast_row() {
    ExtremeRow row{
        .name = "LengthOfACast",
        .topic = "Speeds",
        .swept = "length of a motion towards the ground, m",
        .promise = "At the reported time of contact the gap is between 0 and the tolerance.",
        .figure = "largest gap at the reported time / tolerance",
        .values = {100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e11}};
    row.measure = cast_gap_share;
    row.refusal = [](double length) -> std::string {
        Motion motion;
        motion.start = at_place(0.0, 0.0, 100.0).pose;
        motion.translation.z() = length;
        return cast(Sphere{}, motion, hills()).status == QueryStatus::invalid
                   ? "QueryStatus::invalid"
                   : "";
    };
    row.ends = {{1e11, kInfinite, false, "invalid"}};
    return row;
}

}  // namespace

std::vector<ExtremeRow> motion_rows() {
    return {speed_row(), oblique_speed_row(), long_substep_row(), cast_row(), step_row()};
}

}  // namespace terrane::extremes
