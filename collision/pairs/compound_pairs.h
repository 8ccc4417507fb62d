// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "pairs/convex_core.h"
#include "pairs/convex_pairs.h"

#include <terrane/collision/shapes.h>

#include <array>
#include <limits>

namespace terrane::internal {

/// Non-owning view of a shape as convex parts with a bounding volume tree. A convex shape is its own single part.
class ShapeView {
public:
    ShapeView() = default;
    explicit ShapeView(const Shape& shape);

    bool is_single() const { return compound_ == nullptr || compound_->parts().size() == 1; }
    ConvexView part(std::uint32_t index) const;
    /// Pose of a part in its body; null for a convex shape.
    const Pose* body_from_part(std::uint32_t index) const;
    double reach() const { return reach_; }  ///< bounding radius, metres

    /// Must be called before tree(); only queries with a compound need it.
    void find_bounds();
    std::span<const AabbNode> tree() const;

private:
    const Compound* compound_ = nullptr;
    ConvexView convex_;
    AabbNode own_;  ///< of a convex shape
    double reach_ = 0.0;
};

/// A shape in world axes, relative to an origin near both shapes of a query.
struct PlacedView {
    const ShapeView* view = nullptr;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();

    PlacedConvex part(std::uint32_t index) const;
    PlacedView moved(const Eigen::Vector3d& translation) const {
        return {view, rotation, centre + translation};
    }
};

/// Orthonormal rotation of a part of a rotated body. It has the bits of the body's rotation if the part is not rotated
/// relative to the body.
Eigen::Matrix3d part_rotation(const Eigen::Matrix3d& body, const Pose& body_from_part);

// Traversal of the pairs of parts of two placed shapes through their trees, nearest bounds first.

/// Lower bounds of the signed distances of parts.
class BoundGaps {
public:
    BoundGaps(const PlacedView& a, const PlacedView& b);

    /// Lower bound of the signed distance of any two shapes inside the boxes: the distance between the boxes, or minus
    /// their smallest overlap along a face normal.
    double operator()(const Aabb& of_a, const Aabb& of_b) const;

private:
    Eigen::Matrix3d a_from_b_;
    Eigen::Matrix3d spread_;  ///< absolute values of a_from_b_
    Eigen::Vector3d offset_;  ///< origin of b's body frame, in a's
    double rounding_ = 0.0;
};

/// Calls visit(part_a, part_b, bound) for the pairs whose bound is at most `limit`. visit returns the new limit;
/// -infinity stops the traversal.
///
/// @param bound (box of a, box of b) -> number; must not decrease if a box is replaced by one inside it
template <class Bound, class Visit>
void visit_part_pairs(std::span<const AabbNode> tree_a, std::span<const AabbNode> tree_b,
                      double limit, const Bound& bound, const Visit& visit) {
    struct Entry {
        std::uint32_t a, b;
        double bound;
    };
    // Each descent replaces one pair by two.
    std::array<Entry, 2 * AabbNode::kMaxDepth + 1> stack;
    std::size_t count = 0;
    const auto push = [&](std::uint32_t a, std::uint32_t b, double value) {
        if (value <= limit) stack[count++] = {a, b, value};
    };
    const auto bound_of = [&](std::uint32_t a, std::uint32_t b) {
        return bound(tree_a[a].bounds, tree_b[b].bounds);
    };
    const auto size_of = [](const AabbNode& node) {
        const Eigen::Vector3d side = node.bounds.high - node.bounds.low;
        return node.item != AabbNode::kInner ? -1.0 : dot(side, side);
    };
    push(0, 0, bound_of(0, 0));
    while (count > 0) {
        const Entry entry = stack[--count];
        if (!(entry.bound <= limit)) continue;
        const AabbNode& a = tree_a[entry.a];
        const AabbNode& b = tree_b[entry.b];
        if (a.item != AabbNode::kInner && b.item != AabbNode::kInner) {
            limit = visit(a.item, b.item, entry.bound);
            continue;
        }
        std::uint32_t a2 = entry.a, b2 = entry.b;
        std::uint32_t a1 = a2, b1 = b2;
        if (size_of(a) >= size_of(b)) {
            a1 = entry.a + 1;
            a2 = tree_a[a1].end;
        } else {
            b1 = entry.b + 1;
            b2 = tree_b[b1].end;
        }
        const double first = bound_of(a1, b1);
        const double second = bound_of(a2, b2);
        if (first <= second) {
            push(a2, b2, second);
            push(a1, b1, first);
        } else {
            push(a1, b1, first);
            push(a2, b2, second);
        }
    }
}

/// A pair of parts and their gap.
struct PartGap {
    std::uint32_t part_a = 0;
    std::uint32_t part_b = 0;
    Gap gap;
};

/// The pair of parts with the smallest signed distance. If that exceeds `limit`, the returned distance is any number
/// above `limit`.
PartGap find_least_gap(const PlacedView& a, const PlacedView& b,
                       double limit = std::numeric_limits<double>::infinity());

/// A translation of shape `a` after which no part of `a` overlaps a part of `b` by more than `touch`, a parameter of
/// the functions below.
struct SeparatingTranslation {
    bool is_found = false;
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    double least = 0.0;  ///< lower bound: no shorter translation separates the shapes, metres

    /// Constraints: plane i separates the pair parts[i]. Empty if the translation was found without them.
    HalfSpaces spaces;
    std::array<std::array<std::uint32_t, 2>, HalfSpaces::kMost> parts{};
};

/// Adds a half-space for one overlapping pair of parts after another, until no pair overlaps. Fast, and exact for
/// shallow overlaps; may fail, or return more than the minimum translation.
///
/// @param deepest find_least_gap() of the shapes
SeparatingTranslation grow_separating_translation(const PlacedView& a, const PlacedView& b,
                                                  const PartGap& deepest, double touch);

/// The shortest separating translation found by searches from many directions. The result always separates the shapes.
SeparatingTranslation find_separating_translation(const PlacedView& a, const PlacedView& b,
                                                  const PartGap& deepest, double touch);

struct CompoundContacts {
    std::size_t count = 0;      ///< written, deepest first
    bool is_truncated = false;  ///< some contacts were dropped
};

/// Contacts of all pairs of parts, at most four per normal and 24 normals. Points are relative to the common origin.
///
/// For overlapping shapes, contacts are found after a separating translation, where the shapes just touch; each depth
/// is the component of that translation along the normal. The seams between the parts of a floor therefore cause no
/// contacts.
///
/// @param margin gaps up to this are contacts too, metres
CompoundContacts find_compound_contacts(const PlacedView& a, const PlacedView& b, double margin,
                                        double touch, std::span<PairContact> contacts_out);

struct CompoundCast {
    bool hit = false;
    double fraction = 1.0;
    bool started_in_contact = false;
};

/// The earliest hit over all pairs of parts, which rotate about the origins of their bodies.
///
/// @param motion_a start.rotation is orthonormal; the same for motion_b
CompoundCast cast_compounds(const ShapeView& a, const Motion& motion_a, const ShapeView& b,
                            const Motion& motion_b, const CastSettings& settings);

struct PartRay : ConvexRay {
    std::uint32_t part = 0;
};

/// The first part hit by the segment `from` to `from + displacement`, in the frame of the placement; the lowest index
/// on a tie.
PartRay cast_ray(const PlacedView& shape, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& displacement);

}  // namespace terrane::internal
