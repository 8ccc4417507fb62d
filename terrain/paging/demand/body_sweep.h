// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/chunk_grid.h"
#include "paging/demand/touch_table.h"

#include <terrane/terrain/pager.h>

#include <algorithm>
#include <vector>

namespace terrane::internal {

/// A piece of a body's way: a ball that moves evenly, and grows by what it may have fallen or bounced
/// off its course.
struct Leg {
    double begin = 0.0;     ///< seconds from now
    double duration = 0.0;  ///< seconds
    WorldPos from_world = WorldPos::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double radius = 0.0;
    double growth = 0.0;  ///< metres a second squared: half of it times t^2 is added to the radius
};

/// The way of a body over the horizon. A known way begins where the body is now, passes over moments
/// before now, and stands behind its last one.
///
/// @param legs_out at least one, in order of time; replaced
void find_legs(const BodyNeed& body, double time_s, double horizon, std::vector<Leg>& legs_out);

/// A chunk of the grid that a leg meets.
struct Touch {
    TouchTable::Slot slot;
    double time = 0.0;  ///< since the leg began, s: not later than it is met first
    /// ... not earlier than it is met last; infinity where the leg, or as much of it as is followed,
    /// ends over it.
    double last = 0.0;
};

/// Finds the chunks that legs meet: in the plane the closed square, in height everything up to the
/// highest ground over it. All that are met, and some that are missed by little.
class BodySweep {
public:
    /// The source outlives it.
    BodySweep(const HeightSource& source, int level);

    struct Looks {
        double squares = 0.0;  ///< that were looked at
        bool is_cut = false;   ///< the leg would have taken more than allowed
    };

    /// @param most         squares to look at, about; of a leg that would take more only the beginning
    ///                     is followed, or of a ball that would only the middle
    /// @param table        knows the heights of chunks
    /// @param touches_out  each chunk once; replaced
    Looks find(Leg leg, double most, TouchTable& table, std::vector<Touch>& touches_out);

private:
    /// When a ball's box is over a column or a row.
    struct Window {
        double enter, leave;
        bool is_empty() const { return enter > leave; }
        Window both(const Window& other) const {
            return {std::max(enter, other.enter), std::min(leave, other.leave)};
        }
    };
    /// A column or a row.
    struct Lane {
        double low, high;  // its edges
        Window when;
    };
    struct Motion;
    static void find_lanes(const ChunkAxis& axis, const ChunkSpan& span, const Motion& motion,
                           std::vector<Lane>& lanes_out);
    static bool passes_corner(const Leg& leg, const WorldRect& square, const Window& when);

    ChunkGrid grid_;
    ChunkSpan columns_, rows_;  // with ground
    double highest_;            // of all ground
    double scale_ = 0.0;        // of the numbers that place chunks, metres
    std::vector<Lane> column_lanes_, row_lanes_;
};

}  // namespace terrane::internal
