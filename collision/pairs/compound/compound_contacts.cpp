// SPDX-License-Identifier: MIT
#include "pairs/compound/compound_contacts.h"

#include "pairs/compound/separating_translation.h"

#include <algorithm>
#include <optional>

namespace terrane::internal {
namespace {

constexpr std::size_t kMostNormals = 24;
// 1 - cosine of normals that count as equal: a microradian.
constexpr double kSameNormal = 5e-13;

bool is_before(const PairContact& a, const PairContact& b) {
    if (a.depth != b.depth) return a.depth > b.depth;
    const auto names = [](const PairContact& c) {
        return std::array{c.part_a,           c.part_b,          c.feature_a.first,
                          c.feature_a.second, c.feature_b.first, c.feature_b.second};
    };
    if (names(a) != names(b)) return names(a) < names(b);
    for (int i = 0; i < 3; ++i) {
        if (a.point_world[i] != b.point_world[i]) return a.point_world[i] < b.point_world[i];
    }
    return false;
}

// Contacts grouped by normal.
class Patches {
public:
    void add(const PairContact& contact) {
        Patch* patch = nullptr;
        for (std::size_t i = 0; i < count_ && patch == nullptr; ++i) {
            if (dot(patches_[i]->normal, contact.normal) >= 1.0 - kSameNormal) {
                patch = &*patches_[i];
            }
        }
        if (patch == nullptr) patch = room_for(contact);
        if (patch == nullptr) return;
        patch->deepest = std::max(patch->deepest, contact.depth);
        patch->manifold.add(contact.point_world, contact.depth, contact.feature_a,
                            contact.feature_b, contact.part_a, contact.part_b);
    }

    /// Whether there is a contact of the plane's normal that is at least as deep.
    bool has(const HalfSpace& plane, double touch) const {
        for (std::size_t i = 0; i < count_; ++i) {
            if (dot(patches_[i]->normal, plane.normal) < 1.0 - kSameNormal) continue;
            if (patches_[i]->deepest >= plane.depth - touch) return true;
        }
        return false;
    }

    CompoundContacts finish(std::span<PairContact> contacts_out) {
        std::array<PairContact, 4 * kMostNormals> all;
        std::size_t count = 0;
        std::array<PairContact, 4> of_one;
        for (std::size_t i = 0; i < count_; ++i) {
            const std::size_t found = patches_[i]->manifold.finish(of_one);
            std::copy_n(of_one.begin(), found, all.begin() + static_cast<std::ptrdiff_t>(count));
            count += found;
        }
        std::sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count), is_before);
        const std::size_t kept = std::min(count, contacts_out.size());
        std::copy_n(all.begin(), kept, contacts_out.begin());
        return {kept, is_truncated_ || kept < count};
    }

private:
    struct Patch {
        explicit Patch(const PairContact& first)
            : normal(first.normal),
              deepest(first.depth),
              manifold(first.normal, std::numeric_limits<double>::infinity()) {}
        Eigen::Vector3d normal;
        double deepest;
        Manifold manifold;
    };

    // A new patch; replaces the shallowest one where there are too many.
    Patch* room_for(const PairContact& contact) {
        if (count_ < kMostNormals) return &patches_[count_++].emplace(contact);
        is_truncated_ = true;
        std::size_t least = 0;
        for (std::size_t i = 1; i < count_; ++i) {
            if (patches_[i]->deepest < patches_[least]->deepest) least = i;
        }
        if (!(contact.depth > patches_[least]->deepest)) return nullptr;
        return &patches_[least].emplace(contact);
    }

    std::array<std::optional<Patch>, kMostNormals> patches_;
    std::size_t count_ = 0;
    bool is_truncated_ = false;
};

struct SupportPoint {
    Eigen::Vector3d point;
    ShapeFeature feature;
};

SupportPoint support_point(const PlacedConvex& shape, const Eigen::Vector3d& direction) {
    CoreStorage storage;
    const Core core = std::visit([&](const auto& each) { return make_core(each, storage); }, shape);
    const std::uint32_t vertex = find_extreme(core.shape, core.to_body(direction));
    return {core.vertex(vertex) + core.radius * direction, {vertex, vertex}};
}

// The deepest contact of two parts along the normal of a plane of the separation.
PairContact deepest_contact(const PlacedShape& a, std::uint32_t i, const PlacedShape& b,
                            std::uint32_t j, const HalfSpace& plane) {
    const SupportPoint on_a = support_point(a.part(i), -plane.normal);
    const SupportPoint on_b = support_point(b.part(j), plane.normal);
    return {on_a.point, plane.normal, plane.depth, on_a.feature, on_b.feature, i, j};
}

}  // namespace

CompoundContacts find_compound_contacts(const PlacedShape& a, const PlacedShape& b, double margin,
                                        double touch, std::span<PairContact> contacts_out) {
    const double reported = std::max(margin, touch);
    const PartGap least = find_least_gap(a, b, reported);
    if (!(least.gap.distance <= reported)) return {};
    SeparatingTranslation separation;
    if (least.gap.distance < -touch) {
        separation = grow_separating_translation(a, b, least, touch);
        if (!separation.is_found) separation = find_separating_translation(a, b, least, touch);
    }
    const Eigen::Vector3d& translation = separation.translation;
    const PlacedShape separated = a.moved(translation);
    const double room = length(translation);
    Patches patches;
    // Contacts of a pair after the separating translation, with the depths before it.
    const auto add = [&](std::uint32_t i, std::uint32_t j, const Gap& gap) {
        const double moved = dot(gap.normal, translation);
        if (!(gap.distance <= reported + moved)) return;
        std::array<PairContact, 4> found;
        const std::size_t count =
            find_contacts(separated.part(i), b.part(j), gap, reported + moved, found);
        for (PairContact& contact : std::span(found.data(), count)) {
            contact.point_world -= translation;
            contact.depth += moved;
            contact.part_a = i;
            contact.part_b = j;
            patches.add(contact);
        }
    };
    visit_part_pairs(a.view->tree(), b.view->tree(), reported, BoundGaps(a, b),
                     [&](std::uint32_t i, std::uint32_t j, double) {
                         const Gap gap = find_gap(a.part(i), b.part(j));
                         if (gap.distance <= reported) {
                             add(i, j, room == 0.0 ? gap : find_gap(separated.part(i), b.part(j)));
                         }
                         return reported;
                     });
    if (room == 0.0) return patches.finish(contacts_out);
    // Active planes without a contact after the translation: of round parts, and at corners.
    bool is_all = separation.spaces.count > 0;
    for (std::size_t k = 0; k < separation.spaces.count; ++k) {
        const HalfSpace& plane = separation.spaces.planes[k];
        const bool is_active = dot(plane.normal, translation) <= plane.depth + 1e-9 * room + touch;
        if (!is_active || patches.has(plane, touch)) continue;
        const auto [i, j] = separation.parts[k];
        if (plane.depth >= -reported) {
            patches.add(deepest_contact(a, i, b, j, plane));
        } else {
            is_all = false;  // the parts are too far apart for a contact
        }
    }
    // If an active plane has no contact, one contact along the translation itself stands for all.
    const HalfSpace whole{translation / room, room};
    if (!is_all && !patches.has(whole, touch)) {
        patches.add(deepest_contact(a, least.part_a, b, least.part_b, whole));
    }
    return patches.finish(contacts_out);
}

}  // namespace terrane::internal
