// SPDX-License-Identifier: MIT
#pragma once

#include "ground/cast/approach.h"
#include "ground/frame/local_body.h"

#include <terrane/collision/ground_cast.h>

#include <cmath>

// Bounds of how far a moving, turning shape may go before it can meet a column of the ground.
namespace terrane::internal {

// Largest distance of a shape's points from an axis through its body's origin, metres. The radius of a round shape does
// not count: turning about its core moves nothing.
double find_arm(const LocalShape& shape, const Eigen::Vector3d& axis);

// The motion of a cast; times are fractions of it.
struct Sweep {
    Sweep(const Shape& shape_in, const Motion& motion_in);

    // The body at t in a local frame.
    LocalBody at(const LocalGround& local, double t) const {
        return {shape, motion.at(t).rotation,
                local.to_local(motion.start.translation) + t * motion.translation};
    }
    // find_arm() of a part; 0 where nothing turns.
    double arm_of(const LocalShape& part) const { return spin == 0.0 ? 0.0 : find_arm(part, axis); }

    const Shape& shape;
    const Motion& motion;
    double spin = 0.0;  ///< radians per whole motion
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    double arm = 0.0;  ///< of the whole body, metres
};

// A lower bound of the time at which the gap along n of a moving, turning shape has shrunk to `rest`.
//
// `arm` is find_arm() of the shape, metres.
double bound_time(const Sweep& sweep, const LocalShape& shape, double arm, const Eigen::Vector3d& n,
                  double gap, double rest, double remaining);

// AABB of an AABB that is swept by `translation` while turning moves its points by up to `turned` metres.
struct SweptBox {
    SweptBox(const Eigen::Vector3d& start, const Eigen::Vector3d& bounds_in,
             const Eigen::Vector3d& translation, double turned)
        : centre(start + 0.5 * translation) {
        for (int i = 0; i < 3; ++i)
            bounds[i] = bounds_in[i] + 0.5 * std::abs(translation[i]) + turned;
    }
    double bottom() const { return centre[2] - bounds[2]; }
    CellRange cells(const LocalGround& local) const {
        return local.cells(centre[0] - bounds[0], centre[1] - bounds[1], centre[0] + bounds[0],
                           centre[1] + bounds[1]);
    }

    Eigen::Vector3d centre;
    Eigen::Vector3d bounds;
};

// The result of one test of all columns that could be met in the rest of a piece of the motion.
struct Advance {
    double step;          ///< nothing is met before; initially the rest of the piece
    bool is_hit = false;  ///< at `step`
    Eigen::Vector3d hit_normal = Eigen::Vector3d::UnitZ();
    std::uint32_t hit_part = 0;
    bool is_missing = false;  ///< ground at `step` is not resident
    double error_m = 0.0;
};

// Tests one part: exact where it does not turn, a conservative step where it does.
class AdvanceVisitor {
public:
    // `arm` is find_arm() of the shape; the ground counts as lower by `ground_offset`, metres.
    AdvanceVisitor(const LocalGround& local, const Sweep& sweep, const LocalShape& shape,
                   std::uint32_t part, double arm, double tolerance, double ground_offset,
                   Advance& found)
        : local_(local),
          sweep_(sweep),
          shape_(shape),
          part_(part),
          arm_(arm),
          approach_(shape, sweep.motion.translation, sweep.spin * arm, tolerance, ground_offset),
          found_(found) {}

    // Tests all cells of a range.
    void visit(const CellRange& cells);

    double limit() const { return found_.step; }
    bool wants(const CellPrism& prism) const { return approach_.may_meet(prism, found_.step); }
    void take(const Triangle& triangle, const Approach::Interval& over);

private:
    // The visitor of visit_cells().
    struct CellVisitor;

    void take_straight(const Triangle& triangle, const Approach::Interval& over);
    void take_turning(const Triangle& triangle);
    void hit(double step, const Eigen::Vector3d& normal);

    const LocalGround& local_;
    const Sweep& sweep_;
    const LocalShape& shape_;  // at its current pose
    std::uint32_t part_;
    double arm_;
    Approach approach_;
    Advance& found_;
};

}  // namespace terrane::internal
