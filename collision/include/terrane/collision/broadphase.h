// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

namespace terrane {

/// Indices of two bodies, a < b.
struct BodyPair {
    std::uint32_t a = 0;  ///< lower index
    std::uint32_t b = 0;  ///< higher index

    friend bool operator==(const BodyPair&, const BodyPair&) = default;
};

/// How candidate pairs are found.
enum class BroadphaseKind {
    sap,   ///< sweep-and-prune: boxes sorted along one axis, order kept from update to update
    grid,  ///< sparse grid of cells as large as the largest box: for bodies of similar size
};

/// Finds the pairs of bodies whose boxes, each widened by a margin, overlap or touch.
///
/// Both kinds find the same pairs, in ascending order of (a, b). Both cache candidates across updates: pairs of boxes
/// that overlap if each is enlarged by an eighth of its longest side on every side. The cache stays valid while all but
/// a few bodies remain inside their enlarged boxes. Memory is reused, and linear in bodies and candidates, however far
/// the bodies spread.
///
/// Threads: one at a time.
class Broadphase {
public:
    Broadphase() = default;
    Broadphase(const Broadphase&) = delete;
    Broadphase& operator=(const Broadphase&) = delete;
    virtual ~Broadphase() = default;

    /// Sets the bounds of all bodies.
    ///
    /// @param bounds [bodies] around body i, world axes, metres. A box is empty, and in no pair, if a coordinate is NaN
    ///               or beyond 1e150, or if high < low. The span must stay valid until the next update
    ///
    /// Cost: O(bodies) while the cache is valid. Otherwise still O(bodies) for `grid`, and for `sap` if the order along
    ///       the axis has changed little; else O(bodies log bodies)
    virtual void update(std::span<const Aabb> bounds) = 0;

    /// The pairs. Valid until the next call of any function.
    ///
    /// Cost: O(candidates) while the cache is valid; otherwise a search over all boxes
    virtual std::span<const BodyPair> find_pairs() = 0;

    /// Number of pairs whose boxes the last find_pairs() compared.
    virtual std::uint64_t candidate_count() const = 0;

    /// Elementary operations of the last update(): bodies read, moved, compared or counted, and counters summed.
    virtual std::uint64_t update_operations() const = 0;
};

/// Makes a broadphase without bodies.
/// @param margin added to each side of each box, metres, finite, >= 0
std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind, double margin);

/// The name of a kind: `sap` or `grid`.
std::string_view to_string(BroadphaseKind kind);

}  // namespace terrane
