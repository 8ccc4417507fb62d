// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/version.h>

#include <Eigen/Geometry>

// Public headers that use vectors include Eigen through this header. It includes Eigen/Geometry, because Eigen/Core
// only declares cross(): programs that call it would fail to link.

namespace terrane {

/// A position in the world frame: metres, right-handed, x east, y north, z up. Always double.
using WorldPos = Eigen::Vector3d;

/// A position or vector in a small named frame (chunk, body, eye): metres, float. Eigen refuses to assign a LocalVec to
/// a WorldPos or the reverse, so every conversion is an explicit call below.
using LocalVec = Eigen::Vector3f;

/// x and y in the world, metres or m/s. Converts to and from Eigen::Vector2d, but has an alignment that does not depend
/// on the compiler flags of the including program.
using WorldVec2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;

/// The position `p_world` relative to `origin_world`, in world axes. Subtracts in double and rounds once to float: the
/// error of each component is at most 2^-24 * |p_world - origin_world|.
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
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< the body's origin in the world

    /// Transforms a point p from the body to the world. Inline: the last bits depend on the caller's compiler flags.
    Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + translation; }
};

// Public structs hold only Eigen types whose alignment does not depend on -march or on Eigen's macros; otherwise a
// simulator and this library could disagree about the layout. Not allowed are Vector4d, Quaterniond, Isometry3d and
// Matrix4f (aligned to 16 bytes, or with AVX to 32 or 64), Vector2d and Vector4f (to 16): with EIGEN_MAX_ALIGN_BYTES=0
// all of these are aligned to 8 or 4.
static_assert(!Eigen::Matrix3d::IsRowMajor,
              "EIGEN_DEFAULT_TO_ROW_MAJOR transposes public matrices");
static_assert(alignof(WorldVec2) == alignof(double) && sizeof(WorldVec2) == 16);
static_assert(alignof(Pose) == alignof(double) && sizeof(Pose) == 96);
static_assert(alignof(WorldPos) == alignof(double) && alignof(LocalVec) == alignof(float));

/// An axis-aligned bounding box, closed, metres, in the axes of its frame.
struct Aabb {
    Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< lowest coordinate along each axis
    Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< highest coordinate along each axis, >= low
};

/// A closed sphere that contains a body or an object.
struct BoundingSphere {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< world, metres
    double radius = 0.0;                               ///< metres, >= 0
};

}  // namespace terrane
