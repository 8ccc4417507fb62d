// SPDX-License-Identifier: MIT
#pragma once

// Public headers with vectors get Eigen from here. Geometry, not Core alone: Core
// declares cross() without defining it, so that a caller's program would fail to link.
#include <Eigen/Geometry>

namespace terrane {

/// A position in the world frame: metres, right-handed, x east, y north, z up. Always double.
using WorldPos = Eigen::Vector3d;

/// A position or vector in a small named frame (chunk, body, eye): metres, float. Eigen refuses
/// to assign one to the other, so every crossing is a visible call below.
using LocalVec = Eigen::Vector3f;

/// Subtracts in double and rounds once: `p_world` seen from `origin_world`, world axes.
/// Accuracy: 2^-24 * |p_world - origin_world| per component.
inline LocalVec to_local(const WorldPos& p_world, const WorldPos& origin_world) {
    return (p_world - origin_world).cast<float>();
}

/// Position in the world of a position relative to an origin.
inline WorldPos to_world(const LocalVec& p_local, const WorldPos& origin_world) {
    return origin_world + p_local.cast<double>();
}

/// A rigid motion. Read `world_from_body` from right to left: p_world = world_from_body * p_body.
struct Pose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, determinant 1
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();

    Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + translation; }
};

// Public structs hold only Eigen types whose alignment does not change with -mavx or -march.
// Quaterniond, Isometry3d, Vector4d and Matrix4f do change (16, 32 or 64), so a simulator built
// with -march=native would disagree with this library about their layout.
static_assert(alignof(Pose) == alignof(double) && sizeof(Pose) == 96);
static_assert(alignof(WorldPos) == alignof(double) && alignof(LocalVec) == alignof(float));

}  // namespace terrane
