// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <cmath>

namespace terrane::extremes {
namespace {

constexpr const char* kDepthPromise =
    "No body is deeper in the contact surface than its contact_tolerance.";
constexpr const char* kDepthFigure = "largest depth / contact_tolerance over all steps";

std::string refusal_of(const BodySettings& settings, const BodyState& state) {
    return message_of(World::create({}).value().add(settings, state));
}

ExtremeRow size_row() {
    ExtremeRow row{.name = "SizeOfABody",
                   .topic = "Bodies",
                   .swept = "diameter, m",
                   .promise = kDepthPromise,
                   .figure = kDepthFigure,
                   .values = {1e-6, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3}};
    row.measure = [](double diameter) {
        const double spacing = std::max(1.0, 0.1 * diameter);
        const Result<Source> source = make_hills({.side = 256.0 * spacing,
                                                  .spacing = spacing,
                                                  .amplitude = 2.0 * spacing,
                                                  .wavelength = 20.0 * spacing});
        const Result<Ground> ground = load(**source);
        if (!ground) return kNan;
        return worst_depth_share(*ground, {.shapes = shapes_of_size(0.5 * diameter),
                                           .gap = diameter,
                                           .velocity = {0.0, 0.0, -std::sqrt(20.0 * diameter)}});
    };
    row.refusal = [](double diameter) { return refusal_of({.shape = Sphere{0.5 * diameter}}, {}); };
    row.ends = {{1e-3, -1.0, false, "must be"}, {1e3, 1e300, false, "sphere radius"}};
    return row;
}

ExtremeRow place_row() {
    ExtremeRow row{.name = "PlaceOfABody",
                   .topic = "Places",
                   .swept = "x and y of bodies on the ground, m",
                   .promise = kDepthPromise,
                   .figure = kDepthFigure,
                   .values = {0.0, 1e3, 1e6, 1e7, 1e8, 1e9}};
    row.measure = [](double place) {
        const Result<Source> source = make_hills({.middle_x = place, .middle_y = -place});
        const Result<Ground> ground = load(**source);
        if (!ground) return kNan;
        // The limit bounds the poses of all bodies, which lie east of the first.
        return worst_depth_share(*ground, {.shapes = shapes_of_size(0.5),
                                           .x = place - 20.0,
                                           .y = -place + 0.7,
                                           .gap = 0.5,
                                           .velocity = {0.0, 0.0, -10.0}});
    };
    row.refusal = [](double place) { return refusal_of({}, at_place(place, 0.0, 0.0)); };
    row.ends = {{1e9, 1e300, false, "pose.translation.x"}};
    return row;
}

/// Depth share of two boxes, one of them on the other, of which one has the mass `ratio` and the other 1 kg.
double stack_depth_share(double ratio, bool is_heavy_above) {
    static const Source source = make_flat(128.0, 1.0);
    static const Ground ground = load(*source).value();
    World world = World::create({}).value();
    const Box box{Eigen::Vector3d::Constant(0.5)};
    const double lower = is_heavy_above ? 1.0 : ratio, upper = is_heavy_above ? ratio : 1.0;
    if (!world.add({.shape = box, .mass = lower}, at_place(0.3, 0.7, 5.6))) return kNan;
    if (!world.add({.shape = box, .mass = upper}, at_place(0.3, 0.7, 6.8))) return kNan;
    double worst = 0.0;
    for (int i = 0; i < 300; ++i) {
        if (world.step(ground, 1.0 / 60.0).too_deep > 0) return kInfinite;
        for (std::size_t body = 0; body < 2; ++body) {
            const double share = depth_share(ground, world.settings()[body], world.states()[body]);
            if (!(share <= kInfinite)) return kNan;
            worst = std::max(worst, share);
        }
    }
    return worst;
}

/// Overlap of the two boxes after five seconds, over their side.
double stack_overlap(double ratio) {
    static const Source source = make_flat(128.0, 1.0);
    static const Ground ground = load(*source).value();
    World world = World::create({}).value();
    const Box box{Eigen::Vector3d::Constant(0.5)};
    if (!world.add({.shape = box, .mass = 1.0}, at_place(0.3, 0.7, 5.6))) return kNan;
    if (!world.add({.shape = box, .mass = ratio}, at_place(0.3, 0.7, 6.8))) return kNan;
    for (int i = 0; i < 300; ++i) world.step(ground, 1.0 / 60.0);
    const PairDistanceAnswer answer =
        signed_distance(box, world.states()[0].pose, box, world.states()[1].pose);
    return answer.status == QueryStatus::ok ? std::max(0.0, -answer.distance) : kNan;
}

ExtremeRow mass_row() {
    ExtremeRow row{.name = "MassRatio",
                   .topic = "Bodies",
                   .swept = "mass of a box over the mass of the box below or above it",
                   .promise = kDepthPromise,
                   .figure = kDepthFigure,
                   .values = {1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6}};
    row.measure = [](double ratio) {
        return std::max(stack_depth_share(ratio, true), stack_depth_share(ratio, false));
    };
    row.refusal = [](double mass) { return refusal_of({.mass = mass}, {}); };
    row.ends = {{1.0, 0.0, false, "mass"}, {1e6, 1e300, false, "mass"}};
    return row;
}

ExtremeRow overlap_row() {
    ExtremeRow row = mass_row();
    row.name = "MassRatioOfAPair";
    row.swept = "mass of a box over the mass of the box that it stands on";
    row.promise = "Bodies that overlap separate; the ground has priority.";
    row.figure = "overlap of the two after 5 s, m, of boxes of 1 m";
    row.limit = 0.02;
    row.values = {1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6};
    row.note =
        "Larger ratios are accepted, but nothing is promised: beyond 1e7 the heavier body sinks "
        "into the lighter one.";
    row.measure = stack_overlap;
    return row;
}

/// Depth share of spheres that fall onto level ground in a square pattern, the last step's.
double crowd_depth_share(double count) {
    const double side = std::ceil(std::sqrt(count));
    const Source source = make_flat(std::max(128.0, 2.0 * side + 64.0), 16.0);
    const Result<Ground> ground = load(*source);
    if (!ground) return kNan;
    World world = World::create({.measure_depth = false}).value();
    for (double i = 0.0; i < count; ++i) {
        const double row = std::floor(i / side), column = i - row * side;
        BodyState state = at_place(2.0 * column - side + 0.3, 2.0 * row - side + 0.7, 5.6);
        state.velocity.z() = -5.0;
        if (!world.add({.shape = Sphere{0.5}}, state)) return kNan;
    }
    for (int i = 0; i < 6; ++i) {
        const StepReport report = world.step(*ground, 1.0 / 60.0);
        if (static_cast<double>(report.awake) != count || report.skipped_pairs > 0) return kNan;
    }
    double worst = 0.0;
    for (std::size_t body = 0; body < world.states().size(); ++body) {
        const double share = depth_share(*ground, world.settings()[body], world.states()[body]);
        if (!(share <= kInfinite)) return kNan;
        worst = std::max(worst, share);
    }
    return worst;
}

ExtremeRow count_row() {
    ExtremeRow row{.name = "NumberOfBodies",
                   .topic = "Bodies",
                   .swept = "bodies in one world",
                   .promise = kDepthPromise,
                   .figure = "largest depth / contact_tolerance after an impact at 5 m/s",
                   .values = {1.0, 10.0, 100.0, 1e3},
                   .long_values = {1e4, 1e5, 1e6}};
    row.measure = crowd_depth_share;
    row.refusal = [](double) { return std::string(); };
    row.note = "Only memory limits it: std::bad_alloc.";
    return row;
}

}  // namespace

std::vector<ExtremeRow> body_rows() {
    return {place_row(), size_row(), mass_row(), overlap_row(), count_row()};
}

}  // namespace terrane::extremes
