// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>

namespace terrane::internal {

/// How far the points of the input that a triangle stands for are from it. Two bounds; both hold.
struct TriangleBound {
    /// Displacements from points of the triangle to those of the input are in this box, metres.
    std::array<double, 3> low = {}, high = {};
    /// At the place with weights w0, w1, w2 of the corners the distance is at most
    /// constant + edges[0] w0 w1 + edges[1] w1 w2 + edges[2] w2 w0, metres: corners are vertices of the input, and
    /// little but rounding moves them.
    std::array<double, 3> edges = {};
    double constant = 0.0;  ///< metres

    /// Adds points of the input that are within a distance of some point of the triangle.
    void include(double distance);

    /// The smaller of the largest distances that the two allow, rounded up.
    double largest() const;
};

}  // namespace terrane::internal
