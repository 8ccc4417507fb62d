// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/height_source.h>

#include <memory>

namespace terrane::internal {

/// Two sources on one lattice: the base class of sources composed of two others.
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
    /// A square around a grid, extended by a number of steps on all sides. A mask's interval over it contains its
    /// intervals over all squares within (BlendMask::over()). A mask that is 0 (or 1) over it is therefore so at all
    /// its points.
    WorldRect square_around(const SampleGrid& grid, std::int64_t steps_beyond) const;
    /// The rectangle of the world's root squares, metres.
    WorldRect world() const;

private:
    std::shared_ptr<const HeightSource> a_, b_;
};

/// Fails: invalid_argument for sources of different lattices, or extents that do not overlap
Result<void> check_pair(const HeightSource& a, const HeightSource& b);

/// Distances to a polygon. Threads: any number.
class PolygonDistance {
public:
    /// Requires a polygon that validate() accepts.
    explicit PolygonDistance(Polygon polygon);

    /// Bounding box of the corners, metres.
    const WorldRect& box() const { return box_; }
    /// Whether a position is inside or on an edge.
    bool contains(double x, double y) const;
    /// Distance of a position from the polygon, metres; 0 inside. If the distance is more than `most`, any value
    /// between `most` and the distance may be returned.
    double at(double x, double y, double most) const;
    /// Bound of the rounding error of distances near the polygon, metres.
    double rounding() const { return rounding_; }

private:
    bool is_inside(double x, double y) const;

    Polygon polygon_;
    WorldRect box_;
    double rounding_ = 0.0;
};

}  // namespace terrane::internal
