// SPDX-License-Identifier: MIT
#pragma once

#include "ground/cast/approach.h"
#include "ground/frame/local_body.h"

#include <terrane/collision/ground_cast.h>

#include <cmath>

// How far a moving, turning shape may go before it can meet a column of the ground.
namespace terrane::internal {

// Largest distance of what turning moves of a shape from an axis through its body's origin: turning a
// ball about its centre moves nothing.
double find_arm(const LocalShape& shape, const Eigen::Vector3d& axis);

// What a cast knows about its motion; times are fractions of it.
struct Sweep {
    Sweep(const Shape& shape_in, const Motion& motion_in);

    // The body at t, seen from a local frame.
    LocalBody at(const LocalGround& local, double t) const {
        return {shape, motion.at(t).rotation,
                local.to_local(motion.start.translation) + t * motion.translation};
    }
    // Of a part, once it is made.
    double arm_of(const LocalShape& part) const { return spin == 0.0 ? 0.0 : find_arm(part, axis); }

    const Shape& shape;
    const Motion& motion;
    double spin = 0.0;  ///< radians in all
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    double arm = 0.0;  ///< of the whole body, metres
};

// Time after which the gap along n, taken by the moving points of a shape, may be down to `rest`.
//
// `arm` is the largest distance of those points from the axis of the spin, metres.
double bound_time(const Sweep& sweep, const LocalShape& shape, double arm, const Eigen::Vector3d& n,
                  double gap, double rest, double remaining);

// Bounds of everything that a box passes while it moves on by `way` and its points turn by `turned` metres.
struct SweptBox {
    SweptBox(const Eigen::Vector3d& start, const Eigen::Vector3d& bounds_in,
              const Eigen::Vector3d& translation, double turned)
        : centre(start + 0.5 * translation) {
        for (int i = 0; i < 3; ++i) bounds[i] = bounds_in[i] + 0.5 * std::abs(translation[i]) + turned;
    }
    double bottom() const { return centre[2] - bounds[2]; }
    CellRange cells(const LocalGround& local) const {
        return local.cells(centre[0] - bounds[0], centre[1] - bounds[1], centre[0] + bounds[0],
                           centre[1] + bounds[1]);
    }

    Eigen::Vector3d centre;
    Eigen::Vector3d bounds;
};

// What one look at all columns that could be met in the rest of a piece finds.
struct Advance {
    double step;          ///< up to here nothing is met; starts as what is left of the piece
    bool is_hit = false;  ///< and here it is
    Eigen::Vector3d hit_normal = Eigen::Vector3d::UnitZ();
    std::uint32_t hit_part = 0;
    bool is_missing = false;
    double error_m = 0.0;
};

// The look of one part: exact where it does not turn, a safe step where it does.
class AdvanceVisitor {
public:
    // `arm` is find_arm() of the shape, `ground_offset` how much lower the ground counts as, metres.
    AdvanceVisitor(const LocalGround& local, const Sweep& sweep, const LocalShape& shape,
                   std::uint32_t part, double arm, double tolerance, double ground_offset, Advance& found)
        : local_(local),
          sweep_(sweep),
          shape_(shape),
          part_(part),
          arm_(arm),
          approach_(shape, sweep.motion.translation, sweep.spin * arm, tolerance, ground_offset),
          found_(found) {}

    // Looks at all cells of a range.
    void visit(const CellRange& cells);

    double limit() const { return found_.step; }
    bool wants(const CellPrism& prism) const { return approach_.may_meet(prism, found_.step); }
    void take(const Triangle& triangle, const Approach::Interval& over);

private:
    // What visit_cells() asks for.
    struct CellVisitor;

    void take_straight(const Triangle& triangle, const Approach::Interval& over);
    void take_turning(const Triangle& triangle);
    void hit(double step, const Eigen::Vector3d& normal);

    const LocalGround& local_;
    const Sweep& sweep_;
    const LocalShape& shape_;  // where it is now
    std::uint32_t part_;
    double arm_;
    Approach approach_;
    Advance& found_;
};

}  // namespace terrane::internal
