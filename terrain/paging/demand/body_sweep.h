// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/chunk_grid.h"
#include "paging/demand/touch_table.h"

#include <terrane/terrain/pager.h>

#include <algorithm>
#include <vector>

namespace terrane::internal {

/// A piece of a body's trajectory: a bounding sphere of constant velocity whose radius grows by the distance
/// that gravity or an impact may move the body off its course.
struct MotionSegment {
    double begin = 0.0;     ///< seconds from now
    double duration = 0.0;  ///< seconds
    WorldPos from_world = WorldPos::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double radius = 0.0;
    double growth = 0.0;  ///< m/s^2: growth t^2 / 2 is added to the radius
};

/// The motion of a body over the horizon. A given trajectory starts at the body's present position, skips
/// moments in the past, and ends in rest at its last moment.
///
/// @param segments_out at least one, in order of time; replaced
void find_segments(const BodyNeed& body, double time_s, double horizon,
                   std::vector<MotionSegment>& segments_out);

/// A chunk of the grid that a segment's sphere touches.
struct Touch {
    TouchTable::Slot slot;
    double time = 0.0;  ///< lower bound of the first touch, seconds since the segment's begin
    /// Upper bound of the last touch, the same clock; infinite where the segment, or as much of it as is
    /// followed, ends over the chunk.
    double last = 0.0;
};

/// Finds the chunks that motion segments touch: in the plane their closed square, in height everything up to
/// the highest ground in it. Conservative: all that are touched, and some that are missed by little.
class BodySweep {
public:
    /// The source outlives it.
    BodySweep(const HeightSource& source, int level);

    struct Cost {
        double squares = 0.0;       ///< squares tested
        bool is_truncated = false;  ///< the segment was shortened to stay within the limit
    };

    /// @param most         squares to test, about; a segment that would need more is followed only from its
    ///                     beginning, a sphere that would, only in its middle
    /// @param table        caches the heights of chunks
    /// @param touches_out  each chunk once; replaced
    Cost find(MotionSegment segment, double most, TouchTable& table,
              std::vector<Touch>& touches_out);

    /// Asks for the highest ground again.
    void find_highest(const HeightSource& source);

private:
    /// The time interval in which the sphere's box overlaps a column or a row.
    struct Window {
        double enter, leave;
        bool is_empty() const { return enter > leave; }
        Window intersect(const Window& other) const {
            return {std::max(enter, other.enter), std::min(leave, other.leave)};
        }
    };
    /// A column or a row of chunks.
    struct Lane {
        double low, high;  // its edges
        Window when;
    };
    struct AxisMotion;
    static void find_lanes(const ChunkAxis& axis, const ChunkSpan& span, const AxisMotion& motion,
                           std::vector<Lane>& lanes_out);
    static bool passes_corner(const MotionSegment& segment, const WorldRect& square,
                              const Window& when);

    ChunkGrid grid_;
    ChunkSpan columns_, rows_;  // with ground
    double highest_ = 0.0;      // of all ground
    double scale_ = 0.0;        // largest chunk coordinate, metres
    std::vector<Lane> column_lanes_, row_lanes_;
};

}  // namespace terrane::internal
