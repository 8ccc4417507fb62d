// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/version.h>

#include <Eigen/Geometry>

// Public headers with vectors include Eigen through this header: Eigen/Geometry, because Eigen/Core only declares
// cross(), and a caller's program would fail to link.

namespace terrane {

/// A position in the world frame: metres, right-handed, x east, y north, z up. Always double.
using WorldPos = Eigen::Vector3d;

/// A position or vector in a small named frame (chunk, body, eye): metres, float. Eigen refuses to assign a LocalVec to
/// a WorldPos or the reverse, so every conversion is an explicit call below.
using LocalVec = Eigen::Vector3f;

/// x and y in the world, metres or m/s. Converts to and from Eigen::Vector2d; unlike that, its alignment does not
/// depend on the compiler flags of the including program.
using WorldVec2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;

/// Subtracts in double and rounds once: `p_world` seen from `origin_world`, world axes.
/// Accuracy: 2^-24 * |p_world - origin_world| per component.
inline LocalVec to_local(const WorldPos& p_world, const WorldPos& origin_world) {
    return (p_world - origin_world).cast<float>();
}

/// World position of a position relative to an origin.
inline WorldPos to_world(const LocalVec& p_local, const WorldPos& origin_world) {
    return origin_world + p_local.cast<double>();
}

/// A rigid transform. Read `world_from_body` from right to left: p_world = world_from_body * p_body.
struct Pose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, determinant 1
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< the body's origin

    /// Transforms a point p of the body to the world. Inline: its last bits depend on the caller's compiler flags.
    Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + translation; }
};

// Public structs hold only Eigen types whose alignment does not depend on -march or on Eigen's macros; otherwise a
// simulator and this library could disagree about the layout. Excluded are Vector4d, Quaterniond, Isometry3d, Matrix4f
// (16 bytes, or with AVX 32 or 64), Vector2d and Vector4f: with EIGEN_MAX_ALIGN_BYTES=0 all of these have 8 or 4.
static_assert(!Eigen::Matrix3d::IsRowMajor,
              "EIGEN_DEFAULT_TO_ROW_MAJOR transposes public matrices");
static_assert(alignof(WorldVec2) == alignof(double) && sizeof(WorldVec2) == 16);
static_assert(alignof(Pose) == alignof(double) && sizeof(Pose) == 96);
static_assert(alignof(WorldPos) == alignof(double) && alignof(LocalVec) == alignof(float));

/// An axis-aligned bounding box, closed, metres, in the axes of its frame.
struct Aabb {
    Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< lowest coordinate along each axis
    Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< highest, >= low
};

/// A closed sphere that contains a body or an object.
struct BoundingSphere {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< world, metres
    double radius = 0.0;                               ///< metres, >= 0
};

}  // namespace terrane
