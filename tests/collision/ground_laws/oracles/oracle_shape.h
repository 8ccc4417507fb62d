// SPDX-License-Identifier: MIT
#pragma once

#include "soup.h"

#include <terrane/collision/shapes.h>

#include <array>
#include <vector>

namespace terrane::test {

/// All points within `radius` of the convex hull of some points.
struct OraclePart {
    std::vector<Eigen::Vector3d> points;                ///< body frame
    std::vector<std::array<std::size_t, 2>> edges;      ///< include all edges of the hull
    std::vector<std::array<std::size_t, 3>> triangles;  ///< cover all faces of the hull
    double radius = 0.0;
};

/// A shape of the oracles: a union of rounded hulls, each found by testing all triples of points.
struct OracleShape {
    std::vector<OraclePart> parts;
};

/// The oracle of any shape. A radius comes with a core of one or two points.
OracleShape make_oracle(const Shape& shape);

/// The oracle of the hull of some points, found without the library.
OracleShape make_hull_oracle(std::vector<Eigen::Vector3d> points);

/// A part in its pose, relative to the pose's translation less an offset.
template <class Real>
struct PosedPart {
    const OraclePart* part = nullptr;
    std::vector<Vec<Real>> points;
    Vec<Real> low, high;  ///< bounds, the radius included

    PosedPart(const OraclePart& of, const Eigen::Matrix3d& rotation, const Vec<Real>& offset)
        : part(&of) {
        points.reserve(of.points.size());
        for (const Eigen::Vector3d& p : of.points) {
            points.push_back(rotation.cast<Real>() * p.cast<Real>() + offset);
            low = points.size() == 1 ? points[0] : Vec<Real>(low.cwiseMin(points.back()));
            high = points.size() == 1 ? points[0] : Vec<Real>(high.cwiseMax(points.back()));
        }
        low.array() -= Real(of.radius);
        high.array() += Real(of.radius);
    }
};

}  // namespace terrane::test
