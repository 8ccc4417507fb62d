// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"
#include "shapes/extremes.h"

#include <cstdint>

// The shapes of a pair in world axes, relative to an origin near both.
namespace terrane::internal {

struct PlacedSphere {
    Eigen::Vector3d centre;
    double radius = 0.0;
};

struct PlacedCapsule {
    Eigen::Vector3d centre;
    Eigen::Vector3d half_axis;  ///< from the centre to the end at +z of the body frame
    double radius = 0.0;
};

struct PlacedBox {
    Eigen::Vector3d centre;
    Eigen::Matrix3d rotation;  ///< orthonormal
    Eigen::Vector3d half;
};

struct PlacedHull {
    Eigen::Vector3d centre;    ///< of its body frame
    Eigen::Matrix3d rotation;  ///< orthonormal
    Polyhedron shape;          ///< body frame
    double reach = 0.0;        ///< largest distance of a vertex from the centre
};

/// A convex shape as the kernels see it: the Minkowski sum of a polyhedron, segment or point with a ball.
struct Core {
    Polyhedron shape;  ///< body frame
    Eigen::Matrix3d rotation;
    Eigen::Vector3d centre;
    double radius = 0.0;
    double reach = 0.0;  ///< largest distance of a vertex from the centre

    Eigen::Vector3d to_axes(const Eigen::Vector3d& v_body) const {
        return rotated(rotation, v_body);
    }
    Eigen::Vector3d to_body(const Eigen::Vector3d& v) const { return rotated_back(rotation, v); }
    Eigen::Vector3d vertex(std::uint32_t i) const { return to_axes(shape.vertices[i]) + centre; }
};

/// Storage that cores point into: it must outlive them and must not move.
struct CoreStorage {
    std::array<Eigen::Vector3d, 2> ends;
    BoxStorage box;
};

Core make_core(const PlacedSphere& sphere, CoreStorage& storage_out);
Core make_core(const PlacedCapsule& capsule, CoreStorage& storage_out);
Core make_core(const PlacedBox& box, CoreStorage& storage_out);
Core make_core(const PlacedHull& hull, CoreStorage& storage_out);

/// Lengths below this share of the shapes' sizes count as rounding.
inline constexpr double kTouchShare = 1e-12;

/// Distance up to which two cores touch, metres.
inline double touch_of(const Core& a, const Core& b) {
    return kTouchShare * (a.reach + b.reach + a.radius + b.radius);
}

}  // namespace terrane::internal
