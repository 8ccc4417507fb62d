// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {

/// The normal of a turning plane at the start and the end of a motion: unit, z >= 0.
struct TurningNormal {
    Eigen::Vector3d at_start, at_end;
};

/// The sweep of a convex shape: its poses at both ends of a motion. It turns about the body's origin.
class ConvexSweep {
public:
    ConvexSweep(const LocalShape& start, const LocalShape& end, const Motion& motion,
                double margin);

    /// The gap that a turning plane must have at both ends of the motion, so that it is at least the margin in between,
    /// metres: a function over [0, 1] whose second derivative is at most G is at most G / 8 below its chord.
    double clearance(const TurningNormal& n) const {
        return margin_ + 0.125 * (2.0 * length(n.at_end - n.at_start) * travel_ + acceleration_);
    }
    /// The same for a plane that does not turn.
    double clearance() const { return margin_ + 0.125 * acceleration_; }
    /// How far below the centre at the start a fixed plane must be, to have that gap at both ends, metres.
    double depth(const Eigen::Vector3d& n) const {
        return clearance() +
               std::max(start_.drop(n), end_.drop(n) - dot(n, end_.centre - start_.centre));
    }

    const LocalShape& start() const { return start_; }
    const LocalShape& end() const { return end_; }

private:
    const LocalShape& start_;
    const LocalShape& end_;
    double margin_;
    double travel_;        ///< most distance that any point moves, metres
    double acceleration_;  ///< largest second derivative of the trajectory of any point, metres
};

/// Whether planes prove that a shape stays further than the sweep's margin from every triangle of some cells, during
/// the whole motion.
///
/// @param window holds the cells, all of them ground
bool are_cells_separated(const LocalGround& local, const GroundWindow& window,
                         const CellRange& cells, const ConvexSweep& sweep);

}  // namespace terrane::internal
