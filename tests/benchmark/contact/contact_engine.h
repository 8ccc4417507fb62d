// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <memory>
#include <span>
#include <string>

namespace terrane::bench {

struct Ray {
    WorldPos from, to;
};

/// A translation of a shape.
struct Sweep {
    Pose start;
    Eigen::Vector3d translation;
};

/// Whether a surface cuts a cell from its south-west to its north-east corner.
using Cut = bool (*)(int column, int row);

/// The fraction of a ray or a sweep without a hit.
inline constexpr double kNoHit = 2.0;

/// An engine under comparison. It holds the ground and runs many queries of a kind in one call, in order and without
/// caching: what it keeps between poses of a body is cleared. A call returns false at once where the engine has no such
/// query.
class ContactEngine {
public:
    virtual ~ContactEngine() = default;

    /// With version and precision.
    virtual std::string name() const = 0;
    /// The diagonals of the surfaces that its rays and its contacts use.
    virtual Cut cut_of_rays() const = 0;
    virtual Cut cut_of_contacts() const = 0;

    virtual bool heights(std::span<const Ray> places, std::span<double> heights_out) = 0;
    virtual bool rays(std::span<const Ray> rays, std::span<double> fractions_out) = 0;
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

inline bool cut_as_terrane(int column, int row) { return cut_to_north_east(column, row); }

std::unique_ptr<ContactEngine> make_terrane_engine(const Ground& ground);

/// The table must outlive the engine: samples of the contact surface, row 0 south, world (0, 0) in the south-west.
/// Built only where the library is found.
std::unique_ptr<ContactEngine> make_bullet_engine(const test::HeightTable& table);
std::unique_ptr<ContactEngine> make_ode_engine(const test::HeightTable& table);

}  // namespace terrane::bench
