// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/star_mesh.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Points of the input, each assigned to a triangle of the mesh as it is simplified. Their distances from their
/// triangles estimate how far the input is from the mesh; they decide the order of contractions and certify nothing.
///
/// Sources: A. Ciampalini, P. Cignoni, C. Montani, R. Scopigno. Multiresolution Decimation Based on Global Error. The
///          Visual Computer 13, 1997.
class TrackedPoints {
public:
    /// A triangle that replaces others.
    struct Target {
        std::uint32_t triangle = 0;
        Corners corners;
    };

    /// Assigns each vertex that triangles use to the first of them.
    TrackedPoints(std::span<const Eigen::Vector3d> vertices,
                  std::span<const StarMesh::Triangle> triangles);

    /// Assigns the points of triangles to the targets near them, until the next call or commit(). Returns the largest
    /// distance, metres; stops if it exceeds `limit`.
    ///
    /// @param from must not repeat a triangle
    /// @param to   at least one triangle
    double measure(std::span<const std::uint32_t> from, std::span<const Target> to, double limit);

    /// Largest distance of the points that measure() has assigned to target i, metres.
    double error(std::size_t i) const { return errors_[i]; }

    /// Keeps the assignment of the last measure(), which must not have stopped.
    void commit();

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    struct Point {
        Eigen::Vector3d position;
        std::uint32_t next = kNone;  // the next point of its triangle
    };
    // A target in a frame in which its points are easy to find.
    struct Prism {
        Eigen::Vector3d origin, to_second, to_third,
            normal;  // to_*: dual to the edges; normal: unit, or zero
    };
    struct Assigned {
        std::uint32_t point = 0, target = 0;
    };

    double nearest(const Eigen::Vector3d& p, std::span<const Target> to,
                   std::uint32_t& target_out) const;

    std::vector<Point> points_;
    std::vector<std::uint32_t> first_;  // [triangles] the first point
    // of the last measure()
    std::vector<Prism> prisms_;   // [targets]
    std::vector<double> errors_;  // [targets]
    std::vector<std::uint32_t> from_, target_triangles_;
    std::vector<Assigned> assigned_;
};

}  // namespace terrane::internal
