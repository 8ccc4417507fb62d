// SPDX-License-Identifier: MIT
#pragma once

#include "ground/frame/local_ground.h"
#include "ground/frame/local_shape.h"

#include <terrane/collision/ground_cast.h>

namespace terrane::internal {

/// The normal of a plane at the start of a sweep and at its end: unit, z >= 0.
struct TurningNormal {
    Eigen::Vector3d at_start, at_end;
};

/// A convex shape at both ends of a sweep. Turning carries it round the body's origin.
class ConvexSweep {
public:
    ConvexSweep(const LocalShape& start, const LocalShape& end, const Motion& motion, double margin);

    /// How far a plane's ends have to be from the shape, so that it is no nearer than the margin in between: a
    /// quantity whose second derivative is at most G is at most G / 8 below the line between its ends.
    double clearance(const TurningNormal& n) const {
        return margin_ + 0.125 * (2.0 * length(n.at_end - n.at_start) * travel_ + acceleration_);
    }
    double clearance() const { return margin_ + 0.125 * acceleration_; }
    /// How far below the centre at the start a plane that stands has to be, metres.
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
    double travel_;  ///< of any point, at most
    double acceleration_;    ///< second derivative of the sweep of any point, at most, over the whole of it
};

/// Whether planes prove that a shape stays further than the sweep's margin from every triangle of some cells, all
/// along.
///
/// @param window that holds the cells, all of them ground
bool are_cells_separated(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
               const ConvexSweep& sweep);

}  // namespace terrane::internal
