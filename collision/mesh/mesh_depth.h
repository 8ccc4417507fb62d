// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/mesh_contacts.h"

namespace terrane::internal {

/// A shape at a pose beside the joined surface, in a frame near it.
class MeshQuery {
public:
    MeshQuery(const Shape& shape, const Pose& world_from_shape, const Ground& ground)
        : shape_(shape),
          rotation_(world_from_shape.rotation),
          local_(ground, world_from_shape.translation),
          surface_(local_),
          origin_(local_.to_local(world_from_shape.translation)),
          body_(shape, rotation_, origin_) {}
    MeshQuery(const MeshQuery&) = delete;
    MeshQuery& operator=(const MeshQuery&) = delete;

    const LocalGround& local() const { return local_; }
    const SurfaceTriangles& surface() const { return surface_; }
    const LocalBody& body() const { return body_; }
    /// Smallest n . p of the body's points.
    double lowest(const Eigen::Vector3d& n) const {
        return dot(n, origin_) - support_distance(shape_, -rotated_back(rotation_, n));
    }
    LocalBody moved(const Eigen::Vector3d& d) const { return {shape_, rotation_, origin_ + d}; }
    /// The box around the body, widened.
    Aabb box(double margin) const {
        const Eigen::Vector3d half = body_.whole().bounds + Eigen::Vector3d::Constant(margin);
        return {body_.whole().centre - half, body_.whole().centre + half};
    }

private:
    const Shape& shape_;
    Eigen::Matrix3d rotation_;
    LocalGround local_;
    SurfaceTriangles surface_;
    Eigen::Vector3d origin_;
    LocalBody body_;
};

/// A translation after which a body touches no triangle and lies in the air: verified. Not always the shortest.
struct MeshTranslation {
    bool is_missing = false;  ///< ground that is not resident is in the way
    bool is_found = false;
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
};

/// Finds a short one: out along the contacts of a shallow overlap; else through the nearest points of the surface, then
/// along the contacts there; else up over everything.
///
/// @param overlap of the body
/// Cost: up to some milliseconds
MeshTranslation find_separating_translation(const MeshQuery& query, const MeshOverlap& overlap);

}  // namespace terrane::internal
