// SPDX-License-Identifier: MIT
#include "pairs/compound/part_pairs.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Distance of two boxes along the axes of one frame, or minus their least overlap.
// @param offset between the centres
double gap_of(const Eigen::Vector3d& offset, const Eigen::Vector3d& half_a,
              const Eigen::Vector3d& half_b) {
    double square = 0.0;
    double widest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
        const double gap = std::abs(offset[i]) - (half_a[i] + half_b[i]);
        widest = std::max(widest, gap);
        if (gap > 0.0) square += gap * gap;
    }
    return widest > 0.0 ? std::sqrt(square) : widest;
}

}  // namespace

BoundGaps::BoundGaps(const PlacedShape& a, const PlacedShape& b) {
    const Eigen::Vector3d offset = b.centre - a.centre;
    for (int j = 0; j < 3; ++j) a_from_b_.col(j) = rotated_back(a.rotation, b.rotation.col(j));
    spread_ = a_from_b_.cwiseAbs();
    offset_ = rotated_back(a.rotation, offset);
    rounding_ = 1e-14 * (a.view->reach() + b.view->reach() + length(offset));
}

double BoundGaps::operator()(const Aabb& of_a, const Aabb& of_b) const {
    const Eigen::Vector3d half_a = 0.5 * (of_a.high - of_a.low);
    const Eigen::Vector3d half_b = 0.5 * (of_b.high - of_b.low);
    const Eigen::Vector3d offset =
        rotated(a_from_b_, 0.5 * (of_b.low + of_b.high)) + offset_ - 0.5 * (of_a.low + of_a.high);
    const double in_a = gap_of(offset, half_a, rotated(spread_, half_b));
    const double in_b =
        gap_of(rotated_back(a_from_b_, offset), rotated_back(spread_, half_a), half_b);
    return std::max(in_a, in_b) - rounding_;
}

PartGap find_least_gap(const PlacedShape& a, const PlacedShape& b, double limit) {
    PartGap best;
    best.gap.distance = std::numeric_limits<double>::infinity();
    visit_part_pairs(a.view->tree(), b.view->tree(), limit, BoundGaps(a, b),
                     [&](std::uint32_t i, std::uint32_t j, double) {
                         const Gap gap = find_gap(a.part(i), b.part(j));
                         const bool is_tie = gap.distance == best.gap.distance &&
                                             std::pair(i, j) < std::pair(best.part_a, best.part_b);
                         if (gap.distance < best.gap.distance || is_tie) best = {i, j, gap};
                         return std::min(limit, best.gap.distance);
                     });
    return best;
}

}  // namespace terrane::internal
