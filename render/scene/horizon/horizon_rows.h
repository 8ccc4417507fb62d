// SPDX-License-Identifier: MIT
#pragma once

#include "horizon/sectors.h"

#include <terrane/terrain/resident_set.h>

#include <array>
#include <vector>

namespace terrane::internal {

struct GroundSquare;

/// Slopes of the horizon of the true surface around an eye, by ring and sector.
class HorizonRows {
public:
    using Row = std::array<float, kSectors>;

    /// A lower bound of the largest slope of the true surface in every direction of a sector within a ring and the
    /// ones before it.
    const Row& row(int ring) const { return rows_[static_cast<std::size_t>(ring)]; }

    /// Computes all rows. Requires a set with its roots, all certified, and an eye inside the extent.
    ///
    /// @param in_view sectors that matter; the others become infinite
    void build(const ResidentSet& resident, const Eigen::Vector3d& eye_world,
               const SectorRange& in_view);

private:
    void visit(const GroundSquare& square);
    bool is_below_horizon(const SectorRange& touched, double slope) const;
    void add_occluder(const EyeRect& rect, const Wedge& wedge, double rise);
    void limit(const EyeRect& rect);
    void add_volumes();
    void accumulate();

    const ResidentSet* resident_ = nullptr;  // while building
    Eigen::Vector3d eye_;
    SectorRange in_view_;
    std::vector<Row> rows_;                // [kRings]
    Row highest_;                          // in all rings so far, for pruning
    std::array<double, kSectors> limits_;  // distance up to which all is ground without volumes
};

}  // namespace terrane::internal
