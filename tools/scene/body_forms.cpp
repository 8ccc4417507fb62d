// SPDX-License-Identifier: MIT
#include "scene/body_forms.h"

#include "scene/form_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

using Eigen::Vector3d;

// ---- Crates ----

constexpr int kSide = 256;            // of the texture of a crate's side, pixels
constexpr double kFrameShare = 0.16;  // of the side's texture that the frame covers on each side

double hashed(std::uint32_t x, std::uint32_t y) {
    std::uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca77u;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return static_cast<double>((h ^ (h >> 15)) & 0xffffffu) / 0xffffffu;
}

/// Smooth noise of 0 to 1 with a wavelength of 1.
double noise(double x, double y) {
    const double fx = std::floor(x), fy = std::floor(y), tx = x - fx, ty = y - fy;
    const auto cx = static_cast<std::uint32_t>(static_cast<std::int64_t>(fx));
    const auto cy = static_cast<std::uint32_t>(static_cast<std::int64_t>(fy));
    const double sx = tx * tx * (3.0 - 2.0 * tx), sy = ty * ty * (3.0 - 2.0 * ty);
    const double low = hashed(cx, cy) + sx * (hashed(cx + 1, cy) - hashed(cx, cy));
    const double high = hashed(cx, cy + 1) + sx * (hashed(cx + 1, cy + 1) - hashed(cx, cy + 1));
    return low + sy * (high - low);
}

/// Wood at a point of a crate's side: brightness, and height in units of a pixel.
struct Wood {
    double light = 1.0, height = 0.0;
};

/// A board: `along` and `across` its grain, 0 to 1 of the side; `from_edge` is the distance to its nearest long edge.
Wood board(double along, double across, double from_edge, std::uint32_t number) {
    const double shift = 37.0 * number;
    const double bend = 0.06 * noise(3.0 * along + shift, 2.0 * across);
    const double rings = noise(2.5 * along + shift, 60.0 * (across + bend));
    const double fibre = noise(10.0 * along, 190.0 * across + shift);
    Wood wood;
    wood.light = 0.80 + 0.16 * hashed(number, 7) + 0.17 * (rings - 0.5) + 0.12 * (fibre - 0.5);
    wood.height = 1.2 * (rings - 0.5) + 0.8 * (fibre - 0.5);
    const double edge = std::clamp(from_edge * kSide / 3.5, 0.0, 1.0);
    wood.light *= 0.45 + 0.55 * edge;
    wood.height += 5.0 * edge;
    return wood;
}

void add_nail(Wood& wood, double u, double v, double at_u, double at_v) {
    const double away = std::hypot(u - at_u, v - at_v) * kSide;
    if (away > 4.0) return;
    wood.light *= away < 2.6 ? 0.42 : 0.75;
    wood.height -= away < 2.6 ? 1.5 : 0.0;
}

Wood wood_at(double u, double v) {
    constexpr double f = kFrameShare;
    constexpr int kPlanks = 5;
    const double from_top = std::min(v, 1.0 - v), from_left = std::min(u, 1.0 - u);
    Wood wood;
    if (from_top < f) {  // the boards above and below go from side to side
        wood = board(u, v, std::min(from_top, f - from_top), v < 0.5 ? 1 : 2);
    } else if (from_left < f) {
        wood = board(v, u, std::min({from_left, f - from_left, from_top - f}), u < 0.5 ? 3 : 4);
    } else {
        const double x = (u - f) / (1.0 - 2.0 * f), y = (v - f) / (1.0 - 2.0 * f);
        const double from_diagonal = 0.11 - std::abs(x - y) / std::numbers::sqrt2;
        if (from_diagonal > 0.0) {
            wood = board(0.7 * (x + y), 0.7 * (x - y), from_diagonal, 5);
            wood.height += 4.0;
            for (const double t : {0.06, 0.94}) {
                const double at = f + t * (1.0 - 2.0 * f);
                add_nail(wood, u, v, at + 0.025, at - 0.025);
                add_nail(wood, u, v, at - 0.025, at + 0.025);
            }
        } else {
            const double plank = kPlanks * x, within = plank - std::floor(plank);
            wood = board(v, u, std::min(within, 1.0 - within) / kPlanks,
                         6 + static_cast<std::uint32_t>(plank));
            // the frame's shadow in the corners
            wood.light *= 0.72 + 0.14 * std::min({std::min(x, 1.0 - x) / 0.06,
                                                  std::min(y, 1.0 - y) / 0.06, 2.0});
            if (from_diagonal > -0.03) wood.light *= 0.82;
        }
    }
    for (const double at_u : {0.35 * f, 0.7 * f, 1.0 - 0.7 * f, 1.0 - 0.35 * f}) {
        for (const double at_v : {0.5 * f, 1.0 - 0.5 * f}) add_nail(wood, u, v, at_u, at_v);
    }
    return wood;
}

/// Colours and normals of a crate's side.
MeshMaterial make_crate_material() {
    auto colours = std::make_shared<TextureImage>(), normals = std::make_shared<TextureImage>();
    colours->width = colours->height = normals->width = normals->height = kSide;
    std::vector<double> heights;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const Wood wood = wood_at((x + 0.5) / kSide, 1.0 - (y + 0.5) / kSide);
            heights.push_back(wood.height);
            for (const double part : {186.0, 141.0, 88.0}) {
                colours->rgba.push_back(static_cast<std::uint8_t>(
                    std::clamp(std::lround(part * wood.light), 0L, 255L)));
            }
            colours->rgba.push_back(255);
        }
    }
    const auto height = [&](int x, int y) {
        const int column = std::clamp(x, 0, kSide - 1), row = std::clamp(y, 0, kSide - 1);
        return heights[static_cast<std::size_t>(row * kSide + column)];
    };
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            constexpr double kStrength = 0.35;
            const Vector3d normal = Vector3d(-kStrength * (height(x + 1, y) - height(x - 1, y)),
                                             kStrength * (height(x, y + 1) - height(x, y - 1)), 1.0)
                                        .normalized();
            for (int k = 0; k < 3; ++k) {
                normals->rgba.push_back(
                    static_cast<std::uint8_t>(std::lround(127.5 + 127.5 * normal[k])));
            }
            normals->rgba.push_back(255);
        }
    }
    MeshMaterial material;
    material.colour_texture = {colours, TextureWrap::clamp, TextureWrap::clamp};
    material.normal_texture = {normals, TextureWrap::clamp, TextureWrap::clamp};
    material.roughness = 0.85f;
    return material;
}

void add_quad(TriangleMesh& mesh, const std::array<Vector3d, 4>& corners,
              const std::array<Eigen::Vector2f, 4>& places) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const Vector3d normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalized();
    for (std::size_t i = 0; i < 4; ++i) {
        mesh.positions.push_back(corners[i]);
        mesh.normals.push_back(normal.cast<float>());
        mesh.texture_coordinates.push_back(places[i]);
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
}

}  // namespace

MeshModel make_crate_form(const Eigen::Vector3d& half_extents) {
    static const MeshMaterial material = make_crate_material();
    const double frame = 0.32 * half_extents.minCoeff(), recess = 0.2 * frame;
    MeshModel crate;
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const Vector3d out = (side % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(axis);
        const Vector3d up = axis == 2 ? Vector3d::UnitY() : Vector3d::UnitZ();
        const Vector3d right = up.cross(out);
        const double half_right = std::abs(right.dot(half_extents)),
                     half_up = std::abs(up.dot(half_extents)),
                     depth = std::abs(out.dot(half_extents));
        const std::array xs{-half_right, -half_right + frame, half_right - frame, half_right};
        const std::array ys{-half_up, -half_up + frame, half_up - frame, half_up};
        const std::array shares{0.0, kFrameShare, 1.0 - kFrameShare, 1.0};
        const auto point = [&](std::size_t i, std::size_t k, double below) -> Vector3d {
            return xs[i] * right + ys[k] * up + (depth - below) * out;
        };
        const auto place = [&](std::size_t i, std::size_t k) {
            return Eigen::Vector2f(static_cast<float>(shares[i]), static_cast<float>(shares[k]));
        };
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t k = 0; k < 3; ++k) {
                const double below = i == 1 && k == 1 ? recess : 0.0;
                add_quad(crate.mesh,
                         {point(i, k, below), point(i + 1, k, below), point(i + 1, k + 1, below),
                          point(i, k + 1, below)},
                         {place(i, k), place(i + 1, k), place(i + 1, k + 1), place(i, k + 1)});
            }
        }
        const std::array<std::array<std::size_t, 2>, 4> ring{{{1, 1}, {2, 1}, {2, 2}, {1, 2}}};
        for (std::size_t i = 0; i < 4; ++i) {
            const auto [a, b] = ring[i];
            const auto [c, d] = ring[(i + 1) % 4];
            // the walls show the frame's edge
            const Eigen::Vector2f towards(i == 1   ? 0.02f
                                          : i == 3 ? -0.02f
                                                   : 0.0f,
                                          i == 0   ? -0.02f
                                          : i == 2 ? 0.02f
                                                   : 0.0f);
            add_quad(crate.mesh,
                     {point(a, b, 0.0), point(c, d, 0.0), point(c, d, recess), point(a, b, recess)},
                     {place(a, b) + towards, place(c, d) + towards, place(c, d), place(a, b)});
        }
    }
    crate.mesh.colours.assign(crate.mesh.positions.size(), {255, 255, 255, 255});
    crate.materials = {material};
    return crate;
}

// ---- Characters ----

namespace {

constexpr FormColour kJacket{0.72, 0.30, 0.10};
constexpr FormColour kTrousers{0.24, 0.25, 0.27};
constexpr FormColour kBoots{0.22, 0.15, 0.10};
constexpr FormColour kSkin{0.78, 0.58, 0.46};
constexpr FormColour kFelt{0.30, 0.26, 0.18};
constexpr FormColour kPack{0.20, 0.28, 0.22};

/// Proportions of a walker, relative to its height.
constexpr double kHip = 0.50, kKnee = 0.27, kShoulder = 0.79, kElbow = 0.17, kHand = 0.17;
constexpr double kHipSide = 0.052, kShoulderSide = 0.115;
/// Ends of a boot's sole behind and before the shin's axis, relative to width_of().
constexpr double kHeel = -0.047, kToe = 0.090;

double height_of(const CharacterSettings& settings) {
    return 2.0 * (settings.radius + settings.half_height);
}
/// Unit of widths: that of the height for slim people, less in narrow capsules.
double width_of(const CharacterSettings& settings) {
    return std::min(height_of(settings), settings.radius / 0.19);
}

/// An ellipse across a limb: place and half axes along x and y.
struct Ring {
    double x = 0.0, z = 0.0, half_x = 0.0, half_y = 0.0;
};

/// Adds a limb of rings from below to above.
void add_limb(FormBuilder& builder, std::span<const Ring> rings, int segments = 10) {
    std::vector<Polygon3> sections;
    for (const Ring& ring : rings) {
        Polygon3 section;
        for (int k = 0; k < segments; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / segments;
            section.emplace_back(ring.x + ring.half_x * std::cos(angle),
                                 ring.half_y * std::sin(angle), ring.z);
        }
        sections.push_back(std::move(section));
    }
    builder.add_loft(sections);
}

MeshModel make_trunk(double h, double w) {
    FormBuilder builder;
    builder.set_paint(FormMaterial::matt, kTrousers);
    add_limb(builder, std::array{Ring{0.0, -0.04 * h, 0.04 * w, 0.06 * w},
                                 Ring{0.0, 0.0, 0.066 * w, 0.098 * w},
                                 Ring{0.0, 0.05 * h, 0.062 * w, 0.092 * w}});
    builder.set_paint(FormMaterial::matt, kJacket);
    add_limb(
        builder,
        std::array{Ring{0.0, 0.0, 0.074 * w, 0.104 * w}, Ring{0.0, 0.08 * h, 0.066 * w, 0.096 * w},
                   Ring{0.004 * w, 0.20 * h, 0.076 * w, 0.116 * w},
                   Ring{0.0, 0.28 * h, 0.066 * w, 0.124 * w},
                   Ring{0.0, 0.305 * h, 0.058 * w, 0.110 * w},
                   Ring{0.0, 0.325 * h, 0.046 * w, 0.074 * w},
                   Ring{0.004 * w, 0.345 * h, 0.038 * w, 0.042 * w}},
        14);
    builder.set_paint(FormMaterial::matt, kPack);
    builder.add_box({-0.165 * w, -0.085 * w, 0.08 * h}, {-0.055 * w, 0.085 * w, 0.315 * h},
                    0.025 * w);
    builder.add_box({-0.19 * w, -0.06 * w, 0.10 * h}, {-0.15 * w, 0.06 * w, 0.20 * h}, 0.015 * w);
    for (const double side : {-1.0, 1.0}) {  // straps
        builder.add_box({-0.06 * w, side * 0.065 * w - 0.012 * w, 0.14 * h},
                        {0.078 * w, side * 0.065 * w + 0.012 * w, 0.31 * h}, 0.008 * w);
    }
    builder.set_paint(FormMaterial::matt, kSkin);
    add_limb(builder, std::array{Ring{0.0, 0.33 * h, 0.030 * w, 0.030 * w},
                                 Ring{0.004 * w, 0.372 * h, 0.030 * w, 0.030 * w},
                                 Ring{0.012 * w, 0.385 * h, 0.042 * w, 0.036 * w},
                                 Ring{0.010 * w, 0.43 * h, 0.054 * w, 0.044 * w},
                                 Ring{0.004 * w, 0.465 * h, 0.052 * w, 0.044 * w},
                                 Ring{0.0, 0.488 * h, 0.03 * w, 0.026 * w}});
    builder.set_paint(FormMaterial::matt, kFelt);
    builder.set_frame({Eigen::Matrix3d::Identity(), Vector3d(0.004 * w, 0.0, 0.455 * h)});
    const std::array hat{RingPoint{0.0, 0.0},
                         RingPoint{0.098 * w, -0.006 * h},
                         RingPoint{0.104 * w, 0.0},
                         RingPoint{0.098 * w, 0.004 * h},
                         RingPoint{0.058 * w, 0.008 * h},
                         RingPoint{0.052 * w, 0.026 * h},
                         RingPoint{0.040 * w, 0.0364 * h},
                         RingPoint{0.0, 0.0374 * h}};
    builder.add_turned(hat, 16);
    return builder.finish();
}

MeshModel make_thigh(double h, double w) {
    FormBuilder builder;
    builder.set_paint(FormMaterial::matt, kTrousers);
    const double length = (kHip - kKnee) * h;
    add_limb(builder, std::array{Ring{0.0, -length - 0.025 * h, 0.034 * w, 0.034 * w},
                                 Ring{0.0, -length, 0.040 * w, 0.038 * w},
                                 Ring{0.0, -0.3 * length, 0.052 * w, 0.048 * w},
                                 Ring{0.0, 0.02 * h, 0.054 * w, 0.046 * w}});
    return builder.finish();
}

MeshModel make_shin(double h, double w) {
    FormBuilder builder;
    const double length = kKnee * h;
    builder.set_paint(FormMaterial::matt, kTrousers);
    add_limb(builder, std::array{Ring{0.0, -0.72 * length, 0.034 * w, 0.032 * w},
                                 Ring{-0.006 * w, -0.35 * length, 0.042 * w, 0.038 * w},
                                 Ring{0.0, 0.02 * h, 0.036 * w, 0.035 * w}});
    builder.set_paint(FormMaterial::matt, kBoots);
    add_limb(builder, std::array{Ring{0.0, -0.92 * length, 0.036 * w, 0.034 * w},
                                 Ring{0.0, -0.66 * length, 0.040 * w, 0.038 * w},
                                 Ring{0.0, -0.62 * length, 0.034 * w, 0.032 * w}});
    builder.add_box({(kHeel + 0.002) * w, -0.034 * w, -0.97 * length},
                    {(kToe - 0.003) * w, 0.034 * w, -0.80 * length}, 0.02 * w);
    builder.set_paint(FormMaterial::matt, {0.08, 0.07, 0.06});
    builder.add_box({kHeel * w, -0.036 * w, -length}, {kToe * w, 0.036 * w, -0.94 * length},
                    0.005 * w);
    return builder.finish();
}

MeshModel make_upper_arm(double h, double w) {
    FormBuilder builder;
    builder.set_paint(FormMaterial::matt, kJacket);
    const double length = kElbow * h;
    add_limb(builder, std::array{Ring{0.0, -length - 0.012 * h, 0.028 * w, 0.028 * w},
                                 Ring{0.0, -0.8 * length, 0.034 * w, 0.032 * w},
                                 Ring{0.0, -0.02 * h, 0.042 * w, 0.038 * w},
                                 Ring{0.0, 0.012 * h, 0.028 * w, 0.022 * w}});
    return builder.finish();
}

MeshModel make_forearm(double h, double w) {
    FormBuilder builder;
    const double length = kHand * h;
    builder.set_paint(FormMaterial::matt, kJacket);
    add_limb(builder, std::array{Ring{0.0, -0.78 * length, 0.028 * w, 0.026 * w},
                                 Ring{0.0, -0.2 * length, 0.034 * w, 0.031 * w},
                                 Ring{0.0, 0.01 * h, 0.028 * w, 0.027 * w}});
    builder.set_paint(FormMaterial::matt, kSkin);
    add_limb(builder,
             std::array{Ring{0.006 * w, -1.08 * length, 0.018 * w, 0.012 * w},
                        Ring{0.006 * w, -0.95 * length, 0.028 * w, 0.018 * w},
                        Ring{0.0, -0.74 * length, 0.022 * w, 0.020 * w}},
             8);
    return builder.finish();
}

/// A rotation about y that swings something that hangs down forward.
Eigen::Matrix3d swung(double angle) {
    Eigen::Matrix3d rotation;
    rotation << std::cos(angle), 0.0, -std::sin(angle), 0.0, 1.0, 0.0, std::sin(angle), 0.0,
        std::cos(angle);
    return rotation;
}

}  // namespace

CharacterForm make_character_form(const CharacterSettings& settings) {
    const double h = height_of(settings), w = width_of(settings);
    CharacterForm form;
    form.parts.push_back(make_trunk(h, w));
    for (int side = 0; side < 2; ++side) {
        form.parts.push_back(make_thigh(h, w));
        form.parts.push_back(make_shin(h, w));
        form.parts.push_back(make_upper_arm(h, w));
        form.parts.push_back(make_forearm(h, w));
    }
    return form;
}

std::vector<Pose> character_part_poses(const CharacterSettings& settings,
                                       const Pose& world_from_capsule, double walked,
                                       double speed) {
    constexpr double kStride = 0.8;     // two steps, relative to the height
    constexpr double kFullSpeed = 1.2;  // from which on steps are full, m/s
    constexpr double kBend = 0.06;      // of the knee below a person who stands, radians
    const double h = height_of(settings), w = width_of(settings);
    const double phase = 2.0 * std::numbers::pi * walked / (kStride * h);
    const double share = std::clamp(std::abs(speed) / kFullSpeed, 0.0, 1.0);
    std::vector<Pose> poses(1);
    poses[0].translation = Vector3d(0.0, 0.0, (kHip - 0.5) * h);
    double reach = 0.0;  // of the lower sole below the hips
    for (const double side : {1.0, -1.0}) {
        const double turn = phase + (side > 0.0 ? 0.0 : std::numbers::pi);
        const double thigh = kBend + share * 0.42 * std::sin(turn);
        const double lift = 0.5 + 0.5 * std::cos(turn);  // 1 in the middle of the swing forward
        const double knee = kBend + share * 0.95 * lift * lift;
        const Vector3d hip(0.0, side * kHipSide * w, (kHip - 0.5) * h);
        Pose upper{swung(thigh), hip};
        Pose lower{swung(thigh - knee), upper * Vector3d(0.0, 0.0, -(kHip - kKnee) * h)};
        for (const double end : {kHeel, kToe})
            reach = std::max(reach, hip.z() - (lower * Vector3d(end * w, 0.0, -kKnee * h)).z());
        const double arm = -share * 0.36 * std::sin(turn);
        const Vector3d shoulder(0.0, side * kShoulderSide * w, (kShoulder - 0.5) * h);
        Pose upper_arm{swung(arm), shoulder};
        Pose forearm{swung(arm + 0.15 + 0.35 * share), upper_arm * Vector3d(0.0, 0.0, -kElbow * h)};
        for (const Pose& pose : {upper, lower, upper_arm, forearm}) poses.push_back(pose);
    }
    for (Pose& pose : poses) {
        pose.translation.z() += reach - kHip * h;
        pose = {world_from_capsule.rotation * pose.rotation, world_from_capsule * pose.translation};
    }
    return poses;
}

void CharacterGait::walk(const CharacterState& state, double dt) {
    if (state.stands) walked += dt * state.body.velocity.head<2>().norm();
}

void CharacterGait::follow(const CharacterState& state, const CharacterControls& controls,
                           double dt) {
    constexpr double kTurnTime = 0.3;      // time constant, seconds
    constexpr double kLeastSpeed = 1e-3;   // m/s; slower, it keeps its direction
    constexpr double kLeastLength = 1e-3;  // of a heading that is turning back
    walk(state, dt);
    const Eigen::Vector2d wanted(controls.velocity.x(), controls.velocity.y());
    if (wanted.norm() < kLeastSpeed) return;
    const Eigen::Vector2d turned =
        heading + dt / (dt + kTurnTime) * (wanted.normalized() - heading);
    heading =
        turned.norm() > kLeastLength ? Eigen::Vector2d(turned.normalized()) : wanted.normalized();
}

Pose CharacterGait::world_from_capsule(const WorldPos& centre_world) const {
    Pose pose;
    pose.translation = centre_world;
    pose.rotation << heading.x(), -heading.y(), 0.0,  //
        heading.y(), heading.x(), 0.0,                //
        0.0, 0.0, 1.0;
    return pose;
}

}  // namespace terrane::tools
