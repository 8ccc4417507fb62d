// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace terrane {

/// Whether two closed boxes have a point in common; false for NaN.
inline bool overlap(const Aabb& a, const Aabb& b) {
    return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

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
    /// `sap` of cubes that contain a body at any rotation; boxes are computed only for bodies whose cubes overlap, see
    /// LazyBoxes. For bodies that seldom meet and whose boxes are expensive, such as large hulls and compounds
    two_scene,
};

/// Finds the pairs of bodies whose boxes, each widened by a margin, overlap or touch.
///
/// All kinds find the same pairs, in ascending order of (a, b). They cache candidates across updates: pairs of boxes
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

/// Computes the boxes of those bodies only whose bounds overlap. A broadphase holds the bounds: they contain the boxes
/// and take less time to compute, such as cubes around bounding spheres. A broadphase of all boxes finds the same
/// pairs.
///
/// Threads: one at a time.
class LazyBoxes {
public:
    /// The pairs whose boxes overlap or touch, in ascending order. Valid until the next call.
    ///
    /// @param bounds     after update() with bounds around the boxes of `body_count` bodies
    /// @param box_of     Aabb(std::uint32_t body): the box of a body; called once for each body of a pair of `bounds`,
    ///                   and for no other
    ///
    /// Cost: Broadphase::find_pairs(), and one box for each body in its pairs
    template <class BoxOf>
    std::span<const BodyPair> find_pairs(Broadphase& bounds, std::size_t body_count,
                                         BoxOf&& box_of) {
        pairs_.clear();
        boxes_.resize(body_count);
        is_computed_.assign(body_count, 0);
        computed_count_ = 0;
        const auto box = [&](std::uint32_t body) -> const Aabb& {
            if (is_computed_[body] == 0) {
                boxes_[body] = box_of(body);
                is_computed_[body] = 1;
                ++computed_count_;
            }
            return boxes_[body];
        };
        for (const BodyPair& pair : bounds.find_pairs()) {
            if (overlap(box(pair.a), box(pair.b))) pairs_.push_back(pair);
        }
        return pairs_;
    }

    /// Number of boxes that the last find_pairs() computed.
    std::size_t computed_count() const { return computed_count_; }

private:
    std::vector<Aabb> boxes_;                ///< [bodies]
    std::vector<std::uint8_t> is_computed_;  ///< [bodies]
    std::size_t computed_count_ = 0;
    std::vector<BodyPair> pairs_;
};

/// Makes a broadphase without bodies. `two_scene` sorts like `sap`; its caller gives it cubes and keeps a LazyBoxes.
/// @param margin added to each side of each box, metres, finite, >= 0
std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind, double margin);

/// The name of a kind: `sap`, `grid` or `two-scene`.
std::string_view to_string(BroadphaseKind kind);

}  // namespace terrane
