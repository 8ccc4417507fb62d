// SPDX-License-Identifier: MIT
#pragma once

#include "lift.h"

#include <cstdint>
#include <istream>
#include <string>

namespace judge {

/// Shapes of `terrane drop`; mixed: body index modulo 3 is sphere, capsule, box.
enum class DropShape { sphere, capsule, box, hull, compound, mixed };

/// The parts of one body of a drop, at the origin.
std::vector<Body> make_drop_body(DropShape shape, std::int64_t body_index);

struct Settings {
    DropShape shape = DropShape::sphere;
    double tolerance = 0.01;  ///< largest allowed depth, metres
    double slack = 1e-6;      ///< allowance for rounding of trace and heights, metres
};

struct Report {
    std::uint64_t poses = 0;
    std::uint64_t bodies = 0;
    std::uint64_t touching = 0;  ///< poses that overlap the ground
    std::uint64_t too_deep = 0;  ///< poses deeper than tolerance + slack
    std::uint64_t unjudged = 0;  ///< poses with missing heights below that are not too deep
    double max_lift = 0.0;       ///< upper bound of every depth, metres
    double max_depth = 0.0;      ///< of the poses that were too deep, metres; 0 without any
    std::string first_too_deep;  ///< its line in the trace
    std::string error;           ///< where the trace is malformed; "" where it is not
};

/// Judges every pose of a trace: a header, then one line `step,body,x,y,z,qw,qx,qy,qz` per pose.
Report judge_trace(std::istream& trace, const Surface& surface, const Settings& settings);

}  // namespace judge
