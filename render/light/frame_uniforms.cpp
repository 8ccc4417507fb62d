// SPDX-License-Identifier: MIT
#include "light/frame_uniforms.h"

#include <terrane/base/text.h>

#include <cmath>
#include <string>

namespace terrane::internal {

SplitInteger split(std::int64_t value, int bits) {
    const std::int64_t half = std::int64_t{1} << (bits - 1);
    const std::int64_t high = (value + half) >> bits;
    return {static_cast<std::int32_t>(high),
            static_cast<std::int32_t>(value - high * (std::int64_t{1} << bits))};
}

Result<EyeFrame> make_eye_frame(const Lattice& lattice, const WorldPos& eye_world) {
    const double x = (eye_world.x() - lattice.origin_x) / lattice.spacing;
    const double y = (eye_world.y() - lattice.origin_y) / lattice.spacing;
    const double height = eye_world.z() / lattice.quantum;
    // half the range of SplitInteger: a sample may be equally far from the origin on the opposite side
    constexpr double kMaxIndex = 0x1p49;
    constexpr double kMaxHeight = 0x1p45;
    if (!(std::abs(x) < kMaxIndex && std::abs(y) < kMaxIndex && std::abs(height) < kMaxHeight)) {
        return fail(ErrorCode::invalid_argument,
                    "the eye is too far from the world: " + number_text(eye_world.x()) + ", " +
                        number_text(eye_world.y()) + ", " + number_text(eye_world.z()));
    }
    EyeFrame frame;
    frame.x = std::llround(x);
    frame.y = std::llround(y);
    frame.height = std::llround(height);
    frame.remainder_x = eye_world.x() - lattice.x(frame.x);
    frame.remainder_y = eye_world.y() - lattice.y(frame.y);
    frame.remainder_z = eye_world.z() - lattice.quantum * static_cast<double>(frame.height);
    return frame;
}

namespace {

// Ratio of the near plane's distance to View::near_distance.
constexpr double kNearShare = 0.1;
// Periods of the ground noise, metres. The coarse noise is rotated by (3, 4), which divides its period by 5.
constexpr double kFineNoise = 56.0;
constexpr double kCoarseNoise = 5.0 * 1900.0;
// Height by which moving water covers ground at its level, as the sea of a raster is, metres.
constexpr double kSeaRise = 0.05;
// Movement of the two layers of waves, periods of their noise per second.
constexpr std::array<double, 4> kWaveSpeeds{0.046, 0.035, -0.043, 0.075};

FrameUniforms::Vec4 pack(const Eigen::Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), 0.0f};
}
FrameUniforms::Vec4 pack(const Colour& c) { return {c.red, c.green, c.blue, 1.0f}; }

// Repeats of the noise per metre: a whole number per root square, so that the noise is continuous across its edges.
double repeats_per_metre(double root_size, double wanted) {
    return std::max(1.0, std::round(root_size / wanted)) / root_size;
}

// A coordinate of the eye in its root square, metres from the south-west corner.
double place_in_root(const Lattice& lattice, std::int64_t index, double remainder) {
    const std::int64_t side = lattice.chunk_side(0);
    return lattice.spacing * static_cast<double>(((index % side) + side) % side) + remainder;
}

float fraction(double value) { return static_cast<float>(value - std::floor(value)); }

}  // namespace

FrameUniforms make_frame_uniforms(const RendererSettings& settings, const Lattice& lattice,
                                  const View& view, const EyeFrame& eye, double time) {
    const double half_height = std::tan(0.5 * view.vertical_fov);
    const double half_width = half_height * view.width_px / view.height_px;
    const Eigen::Vector3d right = view.right();

    FrameUniforms frame;
    for (int axis = 0; axis < 3; ++axis) {
        const auto column = static_cast<std::size_t>(4 * axis);
        frame.clip_from_eye[column] = static_cast<float>(right[axis] / half_width);
        frame.clip_from_eye[column + 1] = static_cast<float>(view.up[axis] / half_height);
        frame.clip_from_eye[column + 3] = static_cast<float>(view.forward[axis]);
    }
    frame.clip_from_eye[14] = static_cast<float>(kNearShare * view.near_distance);

    frame.right = pack(Eigen::Vector3d(right * half_width));
    frame.up = pack(Eigen::Vector3d(view.up * half_height));
    frame.forward = pack(view.forward);
    frame.sun = pack(Eigen::Vector3d(settings.sun_direction / settings.sun_direction.norm()));
    frame.horizon = pack(settings.horizon_colour);
    frame.zenith = pack(settings.zenith_colour);
    frame.remainder = pack(Eigen::Vector3d(eye.remainder_x, eye.remainder_y, eye.remainder_z));
    const SplitInteger height = split(eye.height, kHeightBits);
    frame.eye_height = {height.high, height.low, 0, 0};

    // transmittance 1/3 at the haze distance; the shader uses exp2
    const double haze_rate = std::log2(3.0) / settings.haze_distance;
    frame.grid = {static_cast<float>(lattice.spacing), static_cast<float>(lattice.quantum),
                  static_cast<float>(haze_rate),
                  static_cast<float>(1.0 / view.pixels_per_radian())};
    const double fine = repeats_per_metre(lattice.root_size(), kFineNoise);
    const double coarse = repeats_per_metre(lattice.root_size(), kCoarseNoise);
    frame.tint = {static_cast<float>(settings.tint_low),
                  static_cast<float>(1.0 / (settings.tint_high - settings.tint_low)),
                  static_cast<float>(fine), static_cast<float>(coarse)};
    const double x = place_in_root(lattice, eye.x, eye.remainder_x);
    const double y = place_in_root(lattice, eye.y, eye.remainder_y);
    // the coarse noise is rotated as in shade.frag
    frame.noise_phase = {fraction(fine * x), fraction(fine * y),
                         fraction(coarse * (3.0 * x + 4.0 * y)),
                         fraction(coarse * (3.0 * y - 4.0 * x))};
    double water = settings.water_level ? *settings.water_level - view.eye_world.z() : 0.0;
    if (settings.has_waves) {
        water += kSeaRise;
        for (std::size_t i = 0; i < kWaveSpeeds.size(); ++i)
            frame.waves[i] = fraction(time * kWaveSpeeds[i]);
    }
    frame.near = {frame.clip_from_eye[14], static_cast<float>(water), 0.0f, 0.0f};
    return frame;
}

}  // namespace terrane::internal
