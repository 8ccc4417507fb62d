// SPDX-License-Identifier: MIT
#pragma once

#include "contact_engine.h"

#include <cstdint>
#include <vector>

namespace terrane::bench {

/// The contact map, resident at its finest level, and the samples of its surface for the other engines: rounded to
/// quanta, which floats hold exactly.
struct ContactMap {
    Ground ground;
    test::HeightTable table;
    double width() const { return table.spacing * (table.columns - 1); }
};

/// A map of a square of `side` samples. The pager loads it inline. Ends the program with a message
/// where that fails.
ContactMap make_contact_map(int side, double spacing);

/// The same of any table of as many columns as rows.
ContactMap make_map(const test::HeightTable& heights);

/// Vertical rays through the map.
std::vector<Ray> make_vertical_rays(const ContactMap& map, std::size_t count, std::uint64_t seed);
/// From 1.5 to 40 m above the ground, anywhere, `length` metres on, level or up to 9 degrees down.
std::vector<Ray> make_grazing_rays(const ContactMap& map, std::size_t count, double length,
                                   std::uint64_t seed);

/// Random rotations, the centre 0 to `highest` above the ground and `border` or more from the edge.
std::vector<Pose> make_poses(const ContactMap& map, std::size_t count, double highest,
                             double border, std::uint64_t seed);
/// Boxes aligned with the ground, 1 mm deep in it.
std::vector<Pose> make_standing_poses(const ContactMap& map, std::size_t count, const Box& box,
                                      std::uint64_t seed);

/// Poses of a body that rests or lands, as a step finds them: on a surface, within the contact tolerance.
struct ShallowPoses {
    std::vector<Pose> poses;
    /// Metres that each has to sink until it first touches; negative: to rise until it no longer does. The distance
    /// along the normal is at most that.
    std::vector<double> vertical_gaps;
    double margin = 0.0;  ///< gap up to which a step searches contacts, metres: no gap is larger
};

/// Gaps and depths are even between the margin and the tolerance. Every second pose is at rest on the ground below, the
/// others have random rotations.
ShallowPoses make_shallow_poses(const ContactMap& map, Cut cut, const Shape& shape,
                                std::size_t count, std::uint64_t seed);

/// Sweeps of `length` that start clear: the ground within the bounding radius is below it by 5 cm to `highest`.
/// Downward by 3 degrees or more; with `grazing`, every second one at most 22 degrees.
std::vector<Sweep> make_sweeps(const ContactMap& map, std::size_t count, const Shape& shape,
                               double length, double highest, bool grazing, std::uint64_t seed);

}  // namespace terrane::bench
