// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/ground.h>

#include <cstdint>

namespace terrane {

/// Answer of test_contact(): whether a shape touches the ground or another shape.
struct TestAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool is_touching = false;                   ///< whether they touch or overlap
    double error_m = 0.0;  ///< largest error_m of the cells tested, metres; 0 between shapes
};

/// Answer of pseudodistance(): a cheaper measure than the signed distance, with the same sign.
struct PseudodistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double pseudodistance = 0.0;                ///< metres
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit; moving the shape along it increases the measure
    double error_m = 0.0;          ///< as in TestAnswer
};

/// Identifies a vertex (i, i), an edge (i, j) with i < j, or a face (i, kFace) of a shape; stable between calls. Box:
/// bits 0, 1, 2 of a vertex are set if it is at +x, +y, +z; faces 0 to 5 are -x, +x, -y, +y, -z, +z. Hull: indices of
/// vertices() and face(). Capsule: vertices 0 (at -z) and 1 are the ends of the core, edge (0, 1) is the side. Sphere:
/// vertex 0.
struct ShapeFeature {
    static constexpr std::uint32_t kFace = ~std::uint32_t{0};  ///< value of `second` for a face

    std::uint32_t first = 0;   ///< vertex, lower end of an edge, or face
    std::uint32_t second = 0;  ///< the same vertex, upper end of the edge, or kFace
    bool operator==(const ShapeFeature&) const = default;
};

/// Motion of a body over t in [0, 1]: constant velocity of its origin, and constant spin about its origin.
struct Motion {
    Pose start;                                                 ///< at t = 0, world from body
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();      ///< metres, world axes
    Eigen::Vector3d rotation_vector = Eigen::Vector3d::Zero();  ///< axis times radians, world axes

    /// Pose at t. Computes sine and cosine without the C library, so that results do not depend on it.
    Pose at(double t) const;
};

/// The shorter rotation from one orientation to another, as a rotation vector in world axes, radians.
Eigen::Vector3d rotation_vector_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);

/// Removes the rounding errors of a nearly orthonormal rotation matrix, such as a product of many (Gram-Schmidt).
Eigen::Matrix3d orthonormalized(const Eigen::Matrix3d& rotation);

/// Settings of cast().
struct CastSettings {
    /// Largest distance at a reported hit, metres, > 0. A hit is never later than the first touch; a motion that passes
    /// within this distance without touching may be reported as a hit. A cast against the ground is `invalid` if
    /// neighbouring doubles along its motion are farther apart than a quarter of this distance: with the default,
    /// beyond 1.1e11 m.
    double tolerance = 1e-4;
    /// Whether contacts at the start are ignored if the shapes move apart there, until they approach each other again.
    bool skip_separating = false;
};

}  // namespace terrane
