// SPDX-License-Identifier: MIT
#pragma once

#include <compare>
#include <cstdint>

namespace terrane {

/// Names a body of a world. Slots of removed bodies are used again with another generation, so that the id of a removed
/// body never names another one.
struct BodyId {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};  ///< index of no body

    std::uint32_t index = kNone;   ///< slot of the body
    std::uint32_t generation = 0;  ///< counts the bodies that have had the slot

    /// Whether it names a body; only its world knows whether that body still exists.
    constexpr bool is_valid() const { return index != kNone; }

    /// By index, then by generation.
    friend constexpr auto operator<=>(const BodyId&, const BodyId&) = default;
};

/// Layers as bits: which a body is on, and which it collides with.
struct CollisionFilter {
    std::uint32_t layers = 1;                         ///< that the body is on; 0: on none
    std::uint32_t collides_with = ~std::uint32_t{0};  ///< layers that the body collides with

    friend constexpr bool operator==(const CollisionFilter&, const CollisionFilter&) = default;
};

/// Whether two bodies collide: each is on a layer that the other collides with.
constexpr bool may_collide(const CollisionFilter& a, const CollisionFilter& b) {
    return (a.layers & b.collides_with) != 0 && (b.layers & a.collides_with) != 0;
}

}  // namespace terrane
