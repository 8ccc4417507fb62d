// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/aabb.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

namespace terrane {

/// A sphere that contains a body whatever its rotation.
struct BoundingSphere {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< world, metres
    double radius = 0.0;
};

/// Two bodies by their indices, a < b.
struct BodyPair {
    std::uint32_t a = 0;
    std::uint32_t b = 0;

    friend bool operator==(const BodyPair&, const BodyPair&) = default;
};

enum class BroadphaseKind {
    sap,        ///< sweep-and-prune: boxes sorted along one axis, order kept from update to update
    grid,       ///< sparse grid of cells as large as the largest box: for bodies of like size
    two_scene,  ///< sweep-and-prune of cubes that ignore rotation decides whose boxes are compared
    brute,      ///< every pair: the oracle
};

/// Finds which of many bodies could touch: all pairs whose boxes, each widened by a margin, overlap or touch.
///
/// All kinds answer the same pairs, in ascending order of (a, b). No kind needs memory for the volume that
/// bodies are spread over; what an update needs is kept for the next one.
///
/// Threads: one at a time.
class Broadphase {
public:
    Broadphase() = default;
    Broadphase(const Broadphase&) = delete;
    Broadphase& operator=(const Broadphase&) = delete;
    virtual ~Broadphase() = default;

    /// Takes where all bodies are, in world axes, metres; a box is empty where an end of it is not a number,
    /// further than 1e150 from 0 or below its start: bounds[i] and spheres[i] contain body i, and each sphere's cube its box but for
    /// rounding (1e-12 of its coordinates). The arrays stay where they are until the next update.
    ///
    /// Cost: O(bodies) for `grid`; for `sap` and `two_scene` too where the order along the axis has changed by
    /// few places, else O(bodies log bodies)
    virtual void update(std::span<const Aabb> bounds,
                        std::span<const BoundingSphere> spheres) = 0;

    /// The pairs, until the next call of anything.
    virtual std::span<const BodyPair> find_pairs() = 0;

    /// Pairs whose boxes the last find_pairs() compared.
    virtual std::uint64_t candidate_count() const = 0;

    /// Elementary steps of the last update(): a body read, moved, compared or counted, a
    /// counter added up.
    virtual std::uint64_t update_operations() const = 0;
};

/// @param margin that each box is widened by on each side, metres, >= 0
std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind, double margin);

/// `sap`, `grid`, `two-scene` or `brute`.
std::string_view to_string(BroadphaseKind kind);

}  // namespace terrane
