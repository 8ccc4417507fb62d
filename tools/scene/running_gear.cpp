// SPDX-License-Identifier: MIT
//
// Meshes of wheels, sprockets and links of tracks; tracks.cpp places them.
#include "scene/running_gear.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace terrane::tools {
namespace {

using Eigen::Vector3d;

/// Adds a pointed disc about an axis, of the fewest triangles: bolt, hole.
void add_stud(FormBuilder& builder, const Vector3d& place, const Vector3d& axis, double radius,
              double height, int segments) {
    builder.set_frame(along_axis(place, axis));
    const std::array profile{RingPoint{0.0, -height}, RingPoint{radius, 0.0},
                             RingPoint{0.0, height}};
    builder.add_turned(profile, segments);
    builder.set_frame({});
}

}  // namespace

/// Adds a tyre with tread blocks, its rim and hub.
MeshModel make_tyre_wheel(const VehicleSettings& settings, const VehicleLayout& layout) {
    constexpr int kSegments = 14, kBlocks = 8;
    const double r = settings.wheel_radius, b = 0.5 * layout.wheel_width;
    const double tread = 0.93 * r;  // radius between the blocks
    FormBuilder builder;
    const Pose axle = along_axis(Vector3d::Zero(), Vector3d::UnitY());
    builder.set_paint(FormMaterial::matt, kRubber);
    builder.set_frame(axle);
    const std::array tyre{RingPoint{0.56 * r, -0.74 * b}, RingPoint{0.76 * r, -b},
                          RingPoint{tread, -0.78 * b},    RingPoint{tread, 0.78 * b},
                          RingPoint{0.76 * r, b},         RingPoint{0.56 * r, 0.74 * b}};
    builder.add_turned(tyre, kSegments);

    // blocks from the middle to the shoulders, those of one side between those of the other
    builder.set_frame({});
    const double half = 0.30 * 2.0 * std::numbers::pi / kBlocks;  // angle
    constexpr std::array<std::array<double, 2>, 4> kCorners{
        {{-1.0, 0.06}, {1.0, 0.06}, {1.25, 0.99}, {-0.75, 0.99}}};
    for (int k = 0; k < 2 * kBlocks; ++k) {
        const double side = k % 2 == 0 ? 1.0 : -1.0;
        const double middle = std::numbers::pi * k / kBlocks;
        Polygon3 foot, top;
        for (const auto& [turn, y] : kCorners) {
            const double angle = middle + turn * half, shoulder = y > 0.5 ? 1.0 : 0.0;
            const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
            const Vector3d across(0.0, side * y * b, 0.0);
            foot.push_back((0.88 - 0.06 * shoulder) * r * out + across);
            top.push_back((r - 0.035 * r * shoulder) * out + across);
        }
        if (side > 0.0) {
            std::reverse(foot.begin(), foot.end());
            std::reverse(top.begin(), top.end());
        }
        builder.add_loft(std::array{foot, top});
    }

    // the outer side: a dish with holes and a hub
    builder.set_frame(axle);
    builder.set_paint(FormMaterial::steel, kSteel);
    const std::array lip{RingPoint{0.56 * r, 0.74 * b}, RingPoint{0.48 * r, 0.34 * b}};
    builder.add_turned(lip, kSegments);
    builder.set_paint(FormMaterial::steel, mixed(kSteel, kIron, 0.5));
    const std::array dish{RingPoint{0.48 * r, 0.34 * b}, RingPoint{0.22 * r, 0.54 * b},
                          RingPoint{0.17 * r, 0.80 * b}, RingPoint{0.0, 0.86 * b}};
    builder.add_turned(dish, kSegments);
    builder.set_frame({});
    builder.set_paint(FormMaterial::matt, kBlack);
    for (int k = 0; k < 6; ++k) {
        const double angle = 2.0 * std::numbers::pi * (k + 0.5) / 6;
        const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
        const Vector3d normal = (0.20 * b * out / (0.26 * r) + Vector3d::UnitY()).normalized();
        add_stud(builder, 0.35 * r * out + 0.43 * b * Vector3d::UnitY(), normal, 0.065 * r,
                 0.04 * b, 6);
    }
    // the inner side: a drum, and an axle that ends in the body
    builder.set_frame(axle);
    builder.set_paint(FormMaterial::matt, kFrame);
    const double shaft = -1.6 * b;
    const std::array drum{RingPoint{0.0, shaft}, RingPoint{0.09 * r, shaft},
                          RingPoint{0.09 * r, -0.95 * b}, RingPoint{0.40 * r, -0.85 * b},
                          RingPoint{0.56 * r, -0.74 * b}};
    builder.add_turned(drum, kSegments);
    return builder.finish();
}

/// Adds a double road wheel with rubber tyres.
MeshModel make_road_wheel(const VehicleSettings& settings, const VehicleLayout& layout) {
    constexpr int kSegments = 18;
    const double r = settings.wheel_radius - layout.belt_thickness, b = 0.5 * layout.wheel_width;
    FormBuilder builder;
    builder.set_frame(along_axis(Vector3d::Zero(), Vector3d::UnitY()));
    for (const double side : {-1.0, 1.0}) {
        const double from = side > 0.0 ? 0.25 * b : -b, to = side > 0.0 ? b : -0.25 * b;
        builder.set_paint(FormMaterial::matt, kRubber);
        const std::array tyre{RingPoint{0.0, from},         RingPoint{0.96 * r, from},
                              RingPoint{r, from + 0.1 * b}, RingPoint{r, to - 0.1 * b},
                              RingPoint{0.96 * r, to},      RingPoint{0.84 * r, to}};
        builder.add_turned(tyre, kSegments);
        builder.set_paint(FormMaterial::paint, kOlive);
        const std::array dish{RingPoint{0.84 * r, to}, RingPoint{0.74 * r, to - 0.30 * b},
                              RingPoint{0.36 * r, to - 0.12 * b},
                              RingPoint{0.30 * r, to + 0.10 * b}, RingPoint{0.0, to + 0.14 * b}};
        const std::array flat{RingPoint{0.84 * r, to}, RingPoint{0.0, to}};
        if (side > 0.0) {
            builder.add_turned(dish, kSegments);
        } else {  // between the halves
            builder.add_turned(flat, kSegments);
        }
    }
    builder.set_frame({});
    for (int k = 0; k < 8; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / 8;
        const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
        builder.set_paint(FormMaterial::steel, kIron);
        const bool is_hole = k % 2 != 0;
        if (is_hole) builder.set_paint(FormMaterial::matt, kBlack);
        add_stud(builder,
                 (is_hole ? 0.56 * r : 0.24 * r) * out +
                     (is_hole ? 0.80 * b : 1.10 * b) * Vector3d::UnitY(),
                 Vector3d::UnitY(), is_hole ? 0.10 * r : 0.04 * r, is_hole ? 0.04 * b : 0.08 * b,
                 6);
    }
    return builder.finish();
}

MeshModel make_sprocket(const VehicleLayout& layout) {
    constexpr int kSegments = 20, kTeeth = 10;
    const double r = layout.sprocket_radius, b = 0.5 * layout.belt_width;
    FormBuilder builder;
    builder.set_paint(FormMaterial::steel, kIron);
    builder.set_frame(along_axis(Vector3d::Zero(), Vector3d::UnitY()));
    const std::array disc{
        RingPoint{0.0, -b},           RingPoint{0.92 * r, -b},      RingPoint{0.98 * r, -0.8 * b},
        RingPoint{0.8 * r, -0.3 * b}, RingPoint{0.8 * r, 0.3 * b},  RingPoint{0.98 * r, 0.8 * b},
        RingPoint{0.92 * r, b},       RingPoint{0.75 * r, 0.9 * b}, RingPoint{0.35 * r, 0.7 * b},
        RingPoint{0.30 * r, b},       RingPoint{0.0, 1.05 * b}};
    builder.add_turned(disc, kSegments);
    builder.set_frame({});
    for (int k = 0; k < kTeeth; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kTeeth;
        Pose tooth;
        tooth.rotation << std::cos(angle), 0.0, -std::sin(angle), 0.0, 1.0, 0.0, std::sin(angle),
            0.0, std::cos(angle);
        builder.set_frame(tooth);
        for (const double side : {-0.8, 0.8}) {
            const double y = side * b;
            builder.add_solid(std::array{half_space({0, 1, 0}, {0, y + 0.1 * b, 0}),
                                         half_space({0, -1, 0}, {0, y - 0.1 * b, 0}),
                                         half_space({0, 0, 1}, {0, 0, 1.16 * r}),
                                         half_space({0, 0, -1}, {0, 0, 0.8 * r}),
                                         half_space({1, 0, 0.5}, {0.10 * r, 0, r}),
                                         half_space({-1, 0, 0.5}, {-0.10 * r, 0, r})},
                              0.0);
        }
    }
    for (int k = 0; k < kTeeth; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kTeeth;
        const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
        add_stud(builder, 0.82 * b * Vector3d::UnitY() + 0.55 * r * out, Vector3d::UnitY(),
                 0.05 * r, 0.06 * b, 6);
    }
    return builder.finish();
}

/// A link: two shoes with rubber pads, the pins' tubes, and a guide horn between the halves of the wheels.
MeshModel make_link(const VehicleLayout& layout) {
    const double length = layout.link_length, b = 0.5 * layout.belt_width;
    const double t = 0.5 * layout.belt_thickness;
    FormBuilder builder;
    builder.set_paint(FormMaterial::steel, kIron);
    builder.add_box({-0.44 * length, -0.92 * b, -t}, {0.44 * length, 0.92 * b, 0.3 * t}, 0.2 * t);
    for (const double side : {-1.0, 1.0}) {
        const double low = side > 0.0 ? 0.10 * b : -0.80 * b, high = low + 0.70 * b;
        builder.set_paint(FormMaterial::matt, kRubber);
        builder.add_box({-0.34 * length, low, 0.3 * t}, {0.34 * length, high, t}, 0.25 * t);
    }
    builder.set_paint(FormMaterial::steel, kIron);
    builder.set_frame(along_axis({0.5 * length, 0.0, -0.2 * t}, Vector3d::UnitY()));
    const std::array pin{RingPoint{0.0, -b}, RingPoint{0.6 * t, -b}, RingPoint{0.6 * t, b},
                         RingPoint{0.0, b}};
    builder.add_turned(pin, 6);
    builder.set_frame({});
    const double horn = 0.16 * b;
    builder.add_solid(
        std::array{half_space({0, 0, -1}, {0, 0, -3.2 * t}),
                   half_space({0, 0, 1}, {0, 0, -0.9 * t}), half_space({0, 1, -0.2}, {0, horn, -t}),
                   half_space({0, -1, -0.2}, {0, -horn, -t}),
                   half_space({1, 0, -0.3}, {0.28 * length, 0, -t}),
                   half_space({-1, 0, -0.3}, {-0.28 * length, 0, -t})},
        0.0);
    return builder.finish();
}

}  // namespace terrane::tools
