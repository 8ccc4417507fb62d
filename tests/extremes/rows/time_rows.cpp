// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"

#include <cmath>
#include <cstdint>

namespace terrane::extremes {
namespace {

constexpr double kStep = 1e-3;  // seconds: 1 kHz

/// How far a body that rests on level ground moves in a time, metres. It is placed on the ground and settles for two
/// seconds before the time begins.
double drift(const Shape& shape, bool allow_sleep, double seconds) {
    static const Source source = make_flat(128.0, 1.0);
    static const Ground ground = load(*source).value();
    World world = World::create({.allow_sleep = allow_sleep, .measure_depth = false}).value();
    if (!world.add({.shape = shape}, at_place(0.3, 0.7, 5.0 + 0.5))) return kNan;
    for (int i = 0; i < 2000; ++i) world.step(ground, kStep);
    const BodyState before = world.states()[0];
    const auto steps = static_cast<std::int64_t>(std::floor(seconds / kStep + 0.5));
    for (std::int64_t i = 0; i < steps; ++i) world.step(ground, kStep);
    const BodyState& after = world.states()[0];
    const double turned = (after.pose.rotation - before.pose.rotation).cwiseAbs().maxCoeff();
    return (after.pose.translation - before.pose.translation).norm() +
           turned * bounding_radius(shape);
}

ExtremeRow awake_row() {
    ExtremeRow row{.name = "RestOfAnAwakeBody",
                   .topic = "Time",
                   .swept = "seconds at 1 kHz of a body that may not sleep",
                   .promise = "A resting body that may not sleep does not drift.",
                   .figure = "displacement and turn of a box of 1 m, m",
                   .limit = 1e-9,
                   .values = {1.0, 10.0, 100.0},
                   .long_values = {3600.0, 86400.0}};
    row.measure = [](double seconds) {
        return drift(Box{Eigen::Vector3d::Constant(0.5)}, false, seconds);
    };
    row.refusal = [](double) { return std::string(); };
    row.note = "There is no limit: a world does not count steps.";
    return row;
}

ExtremeRow asleep_row() {
    ExtremeRow row = awake_row();
    row.name = "RestOfASleepingBody";
    row.swept = "seconds at 1 kHz of a sleeping body";
    row.promise = "A sleeping body keeps its bits.";
    row.limit = 0.0;
    row.values = {1.0, 3600.0};
    row.long_values = {86400.0};
    row.measure = [](double seconds) {
        return drift(Box{Eigen::Vector3d::Constant(0.5)}, true, seconds);
    };
    return row;
}

}  // namespace

std::vector<ExtremeRow> time_rows() { return {asleep_row(), awake_row()}; }

}  // namespace terrane::extremes
