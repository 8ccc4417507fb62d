// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/extremes.h"
#include "math/vector_math.h"

#include <cstdint>

// Shapes of a pair, placed in world axes around a common origin near both.
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

/// What every shape is for the kernels: a convex polyhedron, down to a segment or a point, and
/// everything within `radius` of it.
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

/// Where the views of cores point to. It outlives them and stays where it is.
struct CoreStorage {
    std::array<Eigen::Vector3d, 2> ends;
    BoxStorage box;
};

Core make_core(const PlacedSphere& sphere, CoreStorage& storage_out);
Core make_core(const PlacedCapsule& capsule, CoreStorage& storage_out);
Core make_core(const PlacedBox& box, CoreStorage& storage_out);
Core make_core(const PlacedHull& hull, CoreStorage& storage_out);

/// Rounding of a length counts for nothing below this share of the sizes.
inline constexpr double kTouchShare = 1e-12;

inline double touch_of(const Core& a, const Core& b) {
    return kTouchShare * (a.reach + b.reach + a.radius + b.radius);
}

}  // namespace terrane::internal
