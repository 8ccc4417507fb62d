// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"

#include <terrane/store/bytes.h>
#include <terrane/volume/volume_shapes.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Everything within `radius` of a segment, world frame. A sphere has a segment of length 0.
struct CapsulePart {
    Eigen::Vector3d from_world, along;  // first end; vector to the second end
    double inverse_square = 0.0;        // 1 / |along|^2; 0 for a sphere
    double radius = 0.0;
};

/// A rotated box, world frame.
struct BoxPart {
    Eigen::Matrix3d world_from_box;
    Eigen::Vector3d centre_world, half_extents;
};

/// Signed distance, metres, negative inside. Accuracy: a few units in the last place of the coordinates.
double signed_distance(const CapsulePart& part, const Eigen::Vector3d& p_world);
double signed_distance(const BoxPart& part, const Eigen::Vector3d& p_world);

/// A shape whose distance has a closed form: a union of capsules, or one box.
struct ExactShape {
    std::vector<CapsulePart> capsules;
    std::vector<BoxPart> boxes;  // at most one, without capsules

    /// Makes the parts of a sphere, capsule, box or tube accepted by validate().
    static ExactShape place(const VolumeOperation& operation);

    Aabb bounds() const;
    /// Smallest extent along any direction, metres.
    double thickness() const;
    /// The least distance to a part.
    double signed_distance(const Eigen::Vector3d& p_world) const;
    std::uint32_t part_count() const {
        return static_cast<std::uint32_t>(capsules.size() + boxes.size());
    }
    double part_distance(std::uint32_t part, const Eigen::Vector3d& p_world) const {
        return boxes.empty() ? internal::signed_distance(capsules[part], p_world)
                             : internal::signed_distance(boxes[part], p_world);
    }
};

/// Checks that a mesh accepted by validate() bounds a solid: every edge has one triangle in each direction, no edge
/// passes through a triangle, and the signed volume is positive. Surfaces may touch.
///
/// Fails: bad_data, naming an edge or two triangles
/// Cost:  O(n log n + p), with n triangles and p pairs of triangles whose boxes overlap (all pairs for a fan)
Result<void> check_closed(const VolumeMesh& mesh);

/// The triangles of a mesh that passes check_closed(), by how many shells contain their shell: [0] the outer shells,
/// [1] the cavities in these, [2] what is solid in the cavities, and so on. A shell is a component that is connected by
/// edges.
///
/// Fails: bad_data, naming a point of the shell, for a cavity whose triangles face outwards, a solid whose triangles
///        face inwards, and a shell without a point of which it is certain that it is on no other shell
/// Cost:  O(n log n), and for each shell the triangles above and below one of its points
Result<std::vector<std::vector<std::array<std::uint32_t, 3>>>> nested_shells(
    const VolumeMesh& mesh);

/// Sum of the areas of a mesh's triangles, square metres.
double surface_area(const VolumeMesh& mesh);

/// Serialises an operation: `op`, the shape's type index and fields, the pose (rotation row by row, then translation),
/// `voxel`. Floating-point values keep their bits.
void put(ByteWriter& out, const VolumeOperation& operation);

/// Reads an operation written by put(); absent if the bytes end early or name an unknown `op` or shape type. Does not
/// check sizes and poses.
std::optional<VolumeOperation> get_operation(ByteReader& in);

}  // namespace terrane::internal
