// SPDX-License-Identifier: MIT
#include "draw/eye_frame.h"

#include <terrane/terrain/number_text.h>

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
    // half the range of SplitInteger: a sample may be as far on the other side of the origin
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

}  // namespace terrane::internal
