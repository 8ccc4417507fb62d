// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace terrane {

// Shapes are closed sets in their own frame, placed by VolumeOperation::world_from_shape. Lengths are in metres.

/// Sphere around the origin.
struct VolumeSphere {
    double radius = 5.0;  ///< metres, > 0
};

/// Everything within `radius` of the segment from (0, 0, -half_height) to (0, 0, half_height).
struct VolumeCapsule {
    double radius = 2.0;       ///< metres, > 0
    double half_height = 5.0;  ///< from the centre to the centre of a cap, metres, >= 0
};

/// Box around the origin, along the axes of the shape's frame.
struct VolumeBox {
    /// Along x, y, z, metres, > 0.
    Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(2.5);
};

/// Everything within `radius` of a polyline: a union of capsules, rounded at joints and ends. The polyline may cross
/// itself.
struct VolumeTube {
    /// At least one point, at most 2^20; metres, shape frame. One point makes a sphere.
    std::vector<Eigen::Vector3d> path_shape = {};
    double radius = 3.0;  ///< metres, > 0
};

/// The inside of a closed mesh of triangles, counter-clockwise seen from outside. Shells may be nested: one whose
/// triangles face inwards is a cavity of the shell around it.
struct VolumeMesh {
    std::vector<Eigen::Vector3d> points_shape = {};            ///< metres, shape frame
    std::vector<std::array<std::uint32_t, 3>> triangles = {};  ///< indices of points
};

/// The inside of a level set in a `.vdb` file of OpenVDB. The shape's frame is the file's world frame.
struct VolumeFile {
    std::string path = {};  ///< path of the `.vdb` file
    std::string grid =
        {};  ///< name of a float grid of class level set; empty: the file's only grid
};

/// The shape of a volume.
using VolumeShape =
    std::variant<VolumeSphere, VolumeCapsule, VolumeBox, VolumeTube, VolumeMesh, VolumeFile>;

/// Whether a volume is taken from the solid or united with it.
enum class VolumeOp : std::uint8_t {
    remove,  ///< a cave, a tunnel, a dig
    add,     ///< an overhang, a bridge, a fill
};

/// One step of a list of operations. Later operations prevail: where shapes overlap, the last one decides.
struct VolumeOperation {
    VolumeOp op = VolumeOp::remove;  ///< remove or add
    VolumeShape shape = {};          ///< the shape
    Pose world_from_shape = {};      ///< pose of the shape
    /// Requested distance between samples of the level set, metres, > 0. The terrain level with the nearest spacing is
    /// used (see Volumes).
    double voxel = 0.5;

    /// Checks sizes, numbers and poses. Meshes and files are checked when they are read (PlacedVolume::create()).
    ///
    /// Fails: invalid_argument, naming the field and its value, for a size that is not above 0 and at most 1e5 m, a
    ///        number that is not finite, a rotation that is not orthonormal to 1e-6, a polyline without points or with
    ///        more than 2^20, a mesh without triangles or with more than 2^22, or an index out of range
    Result<void> validate() const;
};

}  // namespace terrane
