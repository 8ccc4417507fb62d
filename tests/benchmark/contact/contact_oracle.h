// SPDX-License-Identifier: MIT
#pragma once

#include "contact_engine.h"

namespace terrane::bench {

/// The surface of a table, triangle by triangle, by brute force.
class ContactOracle {
public:
    ContactOracle(const test::HeightTable& table, Cut is_cut_to_north_east)
        : table_(table), is_cut_to_north_east_(is_cut_to_north_east) {}

    /// Over a point inside the table, metres.
    double height(double x, double y) const;

    /// Penetration of a sphere, a capsule or a box into any triangle, metres: its radius less the core's distance, or
    /// the least overlap over the axes of the separating axis theorem. Not positive: apart. With its centre above the
    /// surface a shape overlaps the solid exactly where it overlaps a triangle.
    double deepest(const Shape& shape, const Pose& pose) const;

private:
    const test::HeightTable& table_;
    Cut is_cut_to_north_east_;
};

}  // namespace terrane::bench
