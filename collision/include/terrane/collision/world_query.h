// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/body.h>
#include <terrane/collision/query.h>

#include <cstddef>
#include <cstdint>

// Spatial queries of a world: which bodies are asked, and the answers. Of equal answers the body of the lower index is
// given, and a body before the ground. All are `invalid` where an argument is not finite or out of range, also in an
// empty world.
namespace terrane {

/// Which bodies a query sees, and whether it sees the ground.
struct QueryFilter {
    std::uint32_t layers = ~std::uint32_t{0};  ///< sees bodies on at least one of these layers
    BodyId except{};                           ///< not seen, such as the body that asks
    bool include_sensors = false;              ///< sees sensors too
    bool include_ground = true;                ///< sees the ground
};

/// The first hit of a ray.
///
/// `not_resident`: ground that is not loaded may be met before any body; `hit` is false and `fraction` 0.
struct RayQueryAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether anything is met
    double fraction = 1.0;  ///< of the ray, 0 to 1; 0 where it begins inside a body
    BodyId body{};          ///< that is met; of the ground: none
    WorldPos point_world = WorldPos::Zero();  ///< only where `hit`
    /// Unit. Out of the body; against the ray where it begins inside. Of the ground: upwards, from below too.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;  ///< of a body that is a compound: its part

    /// Whether it is the ground that is met.
    bool hits_ground() const { return hit && !body.is_valid(); }
};

/// The first hit of a moving shape. A contact at its start counts only if it closes.
///
/// `not_resident`: ground that is not loaded may be met before any body; `hit` is false, and nothing is met before
/// `fraction`.
struct CastQueryAnswer {
    QueryStatus status = QueryStatus::invalid;          ///< whether the answer is complete
    bool hit = false;                                   ///< whether anything is met
    double fraction = 1.0;                              ///< of the motion, up to the hit
    BodyId body{};                                      ///< that is met; of the ground: none
    WorldPos point_world = WorldPos::Zero();            ///< on the moving shape; only where `hit`
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the moving shape
    std::uint32_t part = 0;                             ///< of a body that is a compound: its part

    /// Whether it is the ground that is met.
    bool hits_ground() const { return hit && !body.is_valid(); }
};

/// The bodies and the ground that a shape touches or overlaps. The bodies are in the caller's buffer, in ascending
/// order of their indices.
///
/// `truncated`:    the buffer was too small and has the bodies of the lowest indices
/// `not_resident`: whether the ground is touched is not known; the bodies are as in other answers
struct OverlapQueryAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    std::size_t count = 0;                      ///< bodies written
    std::size_t touching_count = 0;             ///< bodies touched, written or not
    bool touches_ground = false;                ///< whether the shape overlaps the ground
};

/// The body or the ground nearest to a shape.
///
/// `not_resident`: ground that is not loaded may be nearer; the answer is then the one without that ground.
struct NearestQueryAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool is_found = false;                      ///< whether anything is within the largest distance
    BodyId body{};                              ///< the nearest; of the ground: none
    double distance = 0.0;  ///< signed distance, metres: see shape_pairs.h and ground_queries.h
    WorldPos point_world = WorldPos::Zero();        ///< on the shape that asks
    WorldPos point_other_world = WorldPos::Zero();  ///< on the body or the ground
    /// Unit, towards the shape that asks; distance = normal . (point - point_other)
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;  ///< of a body that is a compound: its part

    /// Whether it is the ground that is nearest.
    bool is_ground() const { return is_found && !body.is_valid(); }
};

}  // namespace terrane
