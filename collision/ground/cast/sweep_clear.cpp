// SPDX-License-Identifier: MIT
#include "ground/cast/sweep_clear.h"

#include "ground/cast/swept_separation.h"
#include "ground/frame/local_body.h"
#include "ground/lift/ground_lift.h"
#include "math/valid_query.h"

namespace terrane::internal {
namespace {

/// Motions that turn by this or more are not tested, radians.
constexpr double kMostTurn = 0.5;

bool is_part_clear(const LocalGround& local, const LocalShape& start, const LocalShape& end,
                   const Motion& motion, double margin) {
    const ConvexSweep sweep(start, end, motion, margin);
    const auto reach = [&](const LocalShape& shape) -> Eigen::Vector3d {
        return shape.bounds + Eigen::Vector3d::Constant(sweep.clearance());
    };
    const Eigen::Vector3d low = (start.centre - reach(start)).cwiseMin(end.centre - reach(end));
    const Eigen::Vector3d high = (start.centre + reach(start)).cwiseMax(end.centre + reach(end));
    const Eigen::Vector3d middle = 0.5 * (low + high);
    if (low[2] > bound_ground(local, middle, high - middle)) return true;
    const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
    const GroundWindow* const window = local.window(cells, 0);
    return window != nullptr && are_cells_separated(local, *window, cells, sweep);
}

}  // namespace

bool is_sweep_clear(const Shape& shape, const Motion& motion, const Ground& ground, double margin) {
    const double spin = length(motion.rotation_vector);
    if (!(spin < kMostTurn) || !is_valid_query(shape, motion)) return false;
    const LocalGround local(ground, motion.start.translation);
    const Eigen::Vector3d from = local.to_local(motion.start.translation);
    const LocalBody start(shape, motion.start.rotation, from);
    const LocalBody end(shape, motion.at(1.0).rotation, from + motion.translation);
    if (!start.is_compound())
        return is_part_clear(local, start.whole(), end.whole(), motion, margin);

    // How far any point of a part may get from its AABB at the start.
    const double reach = margin + length(motion.translation) + spin * bounding_radius(shape);
    bool is_clear = true;
    const auto may_meet = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
        const Eigen::Vector3d half = bounds + Eigen::Vector3d::Constant(reach);
        return is_clear && !(centre[2] - half[2] > bound_ground(local, centre, half));
    };
    start.visit(may_meet, [&](const LocalShape& part, std::uint32_t index) {
        LocalHull hull;
        is_clear = is_clear && is_part_clear(local, part, end.part(index, hull), motion, margin);
    });
    return is_clear;
}

}  // namespace terrane::internal
