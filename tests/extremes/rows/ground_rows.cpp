// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"

#include <terrane/terrain/chunk.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace terrane::extremes {
namespace {

constexpr const char* kErrorPromise =
    "The true surface is within error_m of every height that the ground answers.";
constexpr const char* kErrorFigure = "largest |answer - true height| / error_m over 2000 places";
constexpr const char* kDepthPromise =
    "No body is deeper in the contact surface than its contact_tolerance.";
constexpr const char* kDepthFigure = "largest depth / contact_tolerance over all steps";

/// worst_error_share() of a source over a square, NaN where the source or its chunks fail.
double error_share_of(const Result<Source>& source, double x, double y, double half_side) {
    if (!source) return kNan;
    const WorldRect region = square_around(x, y, half_side);
    const Result<Ground> ground = load(**source, region);
    return ground ? worst_error_share(**source, *ground, region) : kNan;
}

/// worst_depth_share() of a fall on a source, NaN where the source or its chunks fail.
double depth_share_of(const Result<Source>& source, const Fall& fall) {
    if (!source) return kNan;
    const Result<Ground> ground = load(**source);
    return ground ? worst_depth_share(*ground, fall) : kNan;
}

/// Hills whose shape scales with their spacing.
Hills hills_of_spacing(double spacing) {
    // A 4096th of spacings below a metre, as fractals have it.
    // On coarse lattices as much as the height needs.
    const int quantum_log2 =
        spacing < 1.0 ? std::ilogb(spacing) - 12 : std::max(-12, std::ilogb(spacing) - 25);
    return {.side = 256.0 * spacing,
            .spacing = spacing,
            .amplitude = 4.0 * spacing,
            .wavelength = 40.0 * spacing,
            .quantum = std::ldexp(1.0, quantum_log2)};
}

ExtremeRow spacing_row() {
    ExtremeRow row{
        .name = "Spacing",
        .topic = "Spacing of samples",
        .swept = "spacing, m",
        .promise = kErrorPromise,
        .figure = kErrorFigure,
        .values = {kLeastSpacing, 1e-6, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4, kMostSpacing}};
    row.measure = [](double spacing) {
        return error_share_of(make_hills(hills_of_spacing(spacing)), 0.0, 0.0, 120.0 * spacing);
    };
    row.refusal = [](double spacing) { return message_of(Lattice{.spacing = spacing}.validate()); };
    row.ends = {{1e-3, 0.0, false, "spacing"}, {1e4, 1e300, false, "spacing"}};
    return row;
}

ExtremeRow spacing_contact_row() {
    ExtremeRow row = spacing_row();
    row.name = "SpacingUnderBodies";
    row.swept = "spacing of the ground under bodies, m";
    row.promise = kDepthPromise;
    row.figure = kDepthFigure;
    row.values = {1e-6, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4};
    row.measure = [](double spacing) {
        // Bodies of two cells, and metres on coarse ground.
        const double size = std::min(spacing, 50.0);
        return depth_share_of(make_hills(hills_of_spacing(spacing)),
                              {.shapes = shapes_of_size(size),
                               .x = 0.3 * spacing,
                               .y = 0.7 * spacing,
                               .gap = size,
                               .velocity = {0.0, 0.0, -20.0 * size}});
    };
    return row;
}

ExtremeRow place_row() {
    ExtremeRow row{.name = "PlaceOfTheGround",
                   .topic = "Places",
                   .swept = "x and y of the ground, m",
                   .promise = kErrorPromise,
                   .figure = kErrorFigure,
                   .values = {0.0, 1e3, 1e6, 1e7, 1e8, 1e9}};
    row.measure = [](double place) {
        return error_share_of(make_hills({.middle_x = place, .middle_y = -place}), place, -place,
                              120.0);
    };
    row.refusal = [](double place) {
        return message_of(Lattice{.origin_x = place, .spacing = 1e-3}.validate());
    };
    row.ends = {{1e9, 1e300, false, "origin_x"}};
    row.note = "This limit is that of a spacing of 1 mm; it is proportional to the spacing.";
    return row;
}

ExtremeRow fractal_place_row() {
    ExtremeRow row{.name = "PlaceOfAFractal",
                   .topic = "Places",
                   .swept = "x and y of fractal ground, m",
                   .promise = kErrorPromise,
                   .figure = kErrorFigure,
                   .values = {0.0, 1e3, 1e6, 1e7, 1e8, 1e9, 1e11}};
    const auto settings_at = [](double place) {
        FractalSettings settings = fractal_settings();
        settings.root_size_log2 = 20;
        const double root = std::isfinite(place) ? std::floor(place * 0x1p-20) : 1e9;
        settings.first_root_x = static_cast<std::int32_t>(std::clamp(root, -1e9, 1e9)) - 1;
        settings.first_root_y = settings.first_root_x;
        return settings;
    };
    row.measure = [settings_at](double place) {
        return error_share_of(FractalHeights::create(settings_at(place)), place, place, 120.0);
    };
    row.refusal = [settings_at](double place) {
        return message_of(FractalHeights::create(settings_at(place)));
    };
    row.ends = {{1e9, 1e12, false, "root squares"}};
    row.note =
        "Beyond 1e9 m the rounding of doubles shows in queries and answers: 1.5e-5 m at 1e11 m.";
    return row;
}

ExtremeRow height_row() {
    ExtremeRow row{.name = "Height",
                   .topic = "Heights",
                   .swept = "height of the ground, m",
                   .promise = kErrorPromise,
                   .figure = kErrorFigure,
                   .values = {-1e7, -11e3, 0.0, 9e3, 1e7}};
    // 2^30 quanta hold 1e7 m from a quantum of 2^-6 m on.
    const auto hills_at = [](double height) {
        return Hills{.base = height, .quantum = std::abs(height) > 2e5 ? 0x1p-6 : 0x1p-12};
    };
    row.measure = [hills_at](double height) {
        return error_share_of(make_hills(hills_at(height)), 0.0, 0.0, 120.0);
    };
    row.refusal = [](double height) {
        const auto source = make_hills({.base = height, .amplitude = 0.0, .quantum = 0x1p20});
        return source ? message_of(make_chunk(**source, {0, 0, 0})) : message_of(source);
    };
    row.ends = {{0.0, -1e15, false, "range.low"}, {0.0, 1e15, false, "range.low"}};
    row.note =
        "A height is at most 2^30 quanta, so a quantum of 2^-12 m suffices for heights of up to "
        "262 km.";
    return row;
}

ExtremeRow height_contact_row() {
    ExtremeRow row = height_row();
    row.name = "HeightUnderBodies";
    row.swept = "height of the ground under bodies, m";
    row.promise = kDepthPromise;
    row.figure = kDepthFigure;
    row.measure = [](double height) {
        const double quantum = std::abs(height) > 2e5 ? 0x1p-6 : 0x1p-12;
        return depth_share_of(
            make_hills({.base = height, .quantum = quantum}),
            {.shapes = shapes_of_size(0.5), .gap = 0.5, .velocity = {0.0, 0.0, -10.0}});
    };
    row.refusal = [](double height) {
        const auto source = make_hills({.base = height, .amplitude = 0.0, .quantum = 0x1p-6});
        return source ? message_of(make_chunk(**source, {0, 0, 0})) : message_of(source);
    };
    row.ends = {{0.0, -1e9, false, "quantum"}, {0.0, 1e9, false, "quantum"}};
    row.note = "These limits are those of a quantum of 2^-6 m.";
    return row;
}

ExtremeRow slope_row() {
    ExtremeRow row{.name = "Slope",
                   .topic = "Slopes",
                   .swept = "slope",
                   .promise = kErrorPromise,
                   .figure = kErrorFigure,
                   .values = {0.0, 1e-3, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6}};
    row.measure = [](double slope) {
        return error_share_of(make_valleys(slope, 128.0), 0.0, 0.0, 60.0);
    };
    row.refusal = [](double slope) { return message_of(make_valleys(slope, 128.0)); };
    row.ends = {{0.0, -1.0, false, "slope"}, {1.0, 1e300, false, "slope"}};
    return row;
}

ExtremeRow slope_contact_row() {
    ExtremeRow row = slope_row();
    row.name = "SlopeUnderBodies";
    row.swept = "slope under bodies";
    row.promise = kDepthPromise;
    row.figure = kDepthFigure;
    row.measure = [](double slope) {
        return depth_share_of(
            make_valleys(slope, 128.0),
            {.shapes = shapes_of_size(0.5), .gap = 0.5, .velocity = {3.0, 1.0, -30.0}});
    };
    return row;
}

}  // namespace

std::vector<ExtremeRow> ground_rows() {
    return {spacing_row(), spacing_contact_row(), place_row(), fractal_place_row(),
            height_row(),  height_contact_row(),  slope_row(), slope_contact_row()};
}

}  // namespace terrane::extremes
