// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/body.h>
#include <terrane/collision/query.h>

#include <cstddef>
#include <cstdint>

// Filter and answers of a world's spatial queries. On a tie, a body comes before the ground, and a body with a lower
// index before others. An answer is `invalid` if an argument is not finite or out of range, also in an empty world.
namespace terrane {

/// Which bodies a query sees, and whether it sees the ground.
struct QueryFilter {
    std::uint32_t layers = ~std::uint32_t{0};  ///< sees bodies on at least one of these layers
    BodyId except{};                           ///< a body that is not seen, such as the asking one
    bool include_sensors = false;              ///< sees sensors too
    bool include_ground = true;                ///< sees the ground
};

/// The first hit of a ray.
///
/// `not_resident`: the ray may hit ground that is not loaded before any body; `hit` is false and `fraction` 0.
struct RayQueryAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether anything is hit
    double fraction = 1.0;                    ///< of the ray, 0 to 1; 0 if it begins inside a body
    BodyId body{};                            ///< the body hit; none for the ground
    WorldPos point_world = WorldPos::Zero();  ///< only if `hit`
    /// Unit. On a body it points outwards, or against the ray if that begins inside; on the ground upwards, also if hit
    /// from below.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;  ///< part of a compound that is hit, else 0

    /// Whether the ground is hit.
    bool hits_ground() const { return hit && !body.is_valid(); }
};

/// The first hit of a moving shape. A contact at the start of the motion counts only if it is closing.
///
/// `not_resident`: the shape may hit ground that is not loaded before any body; `hit` is false, and nothing is hit
/// before `fraction`.
struct CastQueryAnswer {
    QueryStatus status = QueryStatus::invalid;          ///< whether the answer is complete
    bool hit = false;                                   ///< whether anything is hit
    double fraction = 1.0;                              ///< of the motion, up to the hit
    BodyId body{};                                      ///< the body hit; none for the ground
    WorldPos point_world = WorldPos::Zero();            ///< on the moving shape; only if `hit`
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the moving shape
    std::uint32_t part = 0;                             ///< part of a compound that is hit, else 0

    /// Whether the ground is hit.
    bool hits_ground() const { return hit && !body.is_valid(); }
};

/// Whether a shape touches or overlaps the ground, and how many bodies it touches or overlaps. The caller's buffer
/// receives the bodies, in ascending order of their indices.
///
/// `truncated`:    the buffer was too small; it has the bodies with the lowest indices
/// `not_resident`: it is not known whether the ground is touched; the bodies are complete, or as many as fit
struct OverlapQueryAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    std::size_t count = 0;                      ///< bodies written
    std::size_t touching_count = 0;             ///< bodies touched, written or not
    bool touches_ground = false;                ///< whether the shape touches the ground
};

/// The body or the ground nearest to a shape.
///
/// `not_resident`: ground that is not loaded may be nearer; the answer ignores that ground.
struct NearestQueryAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool is_found = false;                      ///< whether anything is within the largest distance
    BodyId body{};                              ///< the nearest body; none for the ground
    double distance = 0.0;  ///< signed distance, metres: see shape_pairs.h and ground_queries.h
    WorldPos point_world = WorldPos::Zero();        ///< on the query's shape
    WorldPos point_other_world = WorldPos::Zero();  ///< on the body or the ground
    /// Unit, towards the query's shape; distance = normal . (point - point_other)
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;  ///< nearest part of a compound, else 0

    /// Whether the ground is nearest.
    bool is_ground() const { return is_found && !body.is_valid(); }
};

}  // namespace terrane
