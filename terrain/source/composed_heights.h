// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/height_source.h>

#include <memory>

namespace terrane::internal {

/// Two sources on one lattice: the base of what is made of both.
class SourcePair : public HeightSource {
public:
    bool is_certified() const override { return a_->is_certified() && b_->is_certified(); }

protected:
    /// Requires sources that check_pair() accepts.
    SourcePair(std::shared_ptr<const HeightSource> a, std::shared_ptr<const HeightSource> b);

    const HeightSource& a() const { return *a_; }
    const HeightSource& b() const { return *b_; }
    /// The rectangle between two lattice points, metres.
    WorldRect rect(const LatticePoint& low, const LatticePoint& high) const {
        return {lattice().x(low.x), lattice().y(low.y), lattice().x(high.x), lattice().y(high.y)};
    }
    /// A square around a grid, wider by some steps. Masks have intervals over it that contain those over all squares in
    /// the grid (BlendMask::over()), so that what is decided for a grid is what is decided for each of its points.
    WorldRect square_around(const SampleGrid& grid, std::int64_t steps_beyond) const;
    /// Root squares of the world, metres.
    WorldRect world() const;

private:
    std::shared_ptr<const HeightSource> a_, b_;
};

/// Fails: invalid_argument for sources of different lattices, or extents that do not overlap
Result<void> check_pair(const HeightSource& a, const HeightSource& b);

/// A polygon that is asked for distances. Threads: any number.
class PolygonDistance {
public:
    /// Requires a polygon that check() accepts.
    explicit PolygonDistance(Polygon polygon);

    /// Box around the corners, metres.
    const WorldRect& box() const { return box_; }
    /// Whether a place is inside, or on an edge.
    bool contains(double x, double y) const;
    /// Distance of a place, metres: 0 inside. At least `most` where it is found early that it is farther away.
    double at(double x, double y, double most) const;
    /// Bound of the rounding of a distance around the polygon, metres.
    double rounding() const { return rounding_; }

private:
    bool is_inside(double x, double y) const;

    Polygon polygon_;
    WorldRect box_;
    double rounding_ = 0.0;
};

}  // namespace terrane::internal
