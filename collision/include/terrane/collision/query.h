// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/ground.h>

#include <cstdint>

namespace terrane {

/// Answer of test_contact(): whether a shape touches the ground or another shape.
struct TestAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool is_touching = false;                   ///< touch or overlap
    double error_m = 0.0;  ///< largest error_m of the cells tested, metres; 0 between shapes
};

/// Answer of pseudodistance(): a measure with the sign of the signed distance that costs less.
struct PseudodistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double pseudodistance = 0.0;                ///< metres
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit; moving along it increases the measure
    double error_m = 0.0;          ///< as in TestAnswer
};

/// Identifies a vertex (i, i), an edge (i, j) with i < j, or a face (i, kFace) of a shape, stable between calls. Vertex
/// i of a box is at +x where bit 0 of i is set, else at -x; bit 1 is y, bit 2 is z; its faces are -x, +x, -y, +y, -z,
/// +z. Vertices of a hull are indices of vertices(). The ends of a capsule's core are vertices 0 (at -z) and 1, its
/// side is edge (0, 1); a sphere is vertex 0.
struct ShapeFeature {
    static constexpr std::uint32_t kFace = ~std::uint32_t{0};  ///< value of `second` for a face

    std::uint32_t first = 0;   ///< vertex, lower end of an edge, or face
    std::uint32_t second = 0;  ///< the same vertex, upper end of the edge, or kFace
    bool operator==(const ShapeFeature&) const = default;
};

/// A motion with constant velocity and constant spin over t in [0, 1], about the origin of the body.
struct Motion {
    Pose start;                                                 ///< at t = 0, world from body
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();      ///< metres, world axes
    Eigen::Vector3d rotation_vector = Eigen::Vector3d::Zero();  ///< axis times radians, world axes

    /// Pose at t. With its own sine and cosine, so that results do not depend on the C library.
    Pose at(double t) const;
};

/// The shorter rotation from one orientation to another, as a rotation vector in world axes, radians.
Eigen::Vector3d rotation_vector_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);

/// The rotation matrix near one that rounding of many products has made not quite orthonormal.
Eigen::Matrix3d orthonormalized(const Eigen::Matrix3d& rotation);

/// Settings of cast().
struct CastSettings {
    /// A hit is reported at a distance between 0 and this, metres, > 0; never later than the first touch. A motion that
    /// passes within this distance without touching may be reported as a hit. A cast against the ground is `invalid`
    /// where doubles along its motion are more than a quarter of this apart: beyond 1.1e11 m for the default.
    double tolerance = 1e-4;
    /// Contacts at the start that separate are ignored until they close again.
    bool skip_separating = false;
};

}  // namespace terrane
