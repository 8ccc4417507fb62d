// SPDX-License-Identifier: MIT
#pragma once

#include "benchmark/collision/contact_workload.h"

#include <cstdint>

namespace terrane::bench {

/// A translation of a shape.
struct Sweep {
    Pose start;
    Eigen::Vector3d translation;
};

/// Whether a surface cuts a cell from its south-west to its north-east corner.
using Cut = bool (*)(int column, int row);
inline bool cut_as_terrane(int column, int row) { return cut_to_north_east(column, row); }

/// The fraction of a sweep without a hit.
inline constexpr double kNoHit = 2.0;

/// Ends of the vertical rays that check the surface of an engine, metres.
inline constexpr double kRayTop = 200.0, kRayBottom = -200.0;

/// An engine under comparison. It holds the ground and runs many queries of a kind in one call, in order; caches are
/// cleared between poses. A call returns false at once if the engine has no such query.
class ContactEngine {
public:
    virtual ~ContactEngine() = default;

    /// With version and precision.
    virtual std::string name() const = 0;
    /// The diagonals of the surfaces that its rays and its contacts use.
    virtual Cut cut_of_rays() const = 0;
    virtual Cut cut_of_contacts() const = 0;

    /// Where a vertical ray from kRayTop to kRayBottom meets the surface, metres.
    virtual double height(double x, double y) = 0;
    /// Whether contacts() finds gaps up to the margin too, and not only overlaps.
    virtual bool has_margin() const { return false; }
    /// Points of the manifold; 0: apart.
    ///
    /// @param margin gap up to which contacts are wanted, metres; without effect in an engine without has_margin()
    virtual bool contacts(const Shape& shape, std::span<const Pose> poses, double margin,
                          std::span<int> counts_out) = 0;
    virtual bool casts(const Shape& shape, std::span<const Sweep> sweeps,
                       std::span<double> fractions_out) = 0;
};

/// The table must outlive the engine. Built only where the library is found.
std::unique_ptr<ContactEngine> make_bullet_engine(const test::HeightTable& table);
std::unique_ptr<ContactEngine> make_ode_engine(const test::HeightTable& table);

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
