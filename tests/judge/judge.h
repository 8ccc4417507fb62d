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
    double tolerance = 0.01;  ///< depth that no body may exceed, metres
    double slack = 1e-6;      ///< for the digits of the trace and of the heights, metres
};

struct Report {
    std::uint64_t poses = 0;
    std::uint64_t bodies = 0;
    std::uint64_t touching = 0;  ///< poses that overlap the ground at all
    std::uint64_t too_deep = 0;  ///< poses deeper than tolerance + slack
    std::uint64_t unjudged = 0;  ///< poses with heights missing under them, and not too deep
    double max_lift = 0.0;       ///< bounds every depth
    double max_depth = 0.0;      ///< of the poses that were too deep; 0 where none was
    std::string first_too_deep;  ///< its line of the trace
    std::string error;           ///< not empty: the trace is malformed, and where
};

/// Judges every pose of a trace, `step,body,x,y,z,qw,qx,qy,qz` a line after a header.
Report judge_trace(std::istream& trace, const Surface& surface, const Settings& settings);

}  // namespace judge
