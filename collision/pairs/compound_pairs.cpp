// SPDX-License-Identifier: MIT
#include "pairs/compound_pairs.h"

#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <optional>

namespace terrane::internal {
namespace {

ConvexView view_of(const ConvexHull& hull) {
    return HullView{polyhedron(hull), bounding_radius(hull)};
}
template <typename Primitive>
ConvexView view_of(const Primitive& shape) {
    return shape;
}

Aabb bounds_of(const Sphere& sphere) {
    const Eigen::Vector3d high = Eigen::Vector3d::Constant(sphere.radius);
    return {-high, high};
}
Aabb bounds_of(const Capsule& capsule) {
    const double r = capsule.radius;
    const Eigen::Vector3d high(r, r, r + capsule.half_height);
    return {-high, high};
}
Aabb bounds_of(const Box& box) { return {-box.half_extents, box.half_extents}; }
Aabb bounds_of(const HullView& hull) {
    Aabb bounds;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d up = Eigen::Vector3d::Unit(axis);
        bounds.low[axis] = hull.shape.vertices[find_extreme(hull.shape, -up)][axis];
        bounds.high[axis] = hull.shape.vertices[find_extreme(hull.shape, up)][axis];
    }
    return bounds;
}

}  // namespace

ShapeView::ShapeView(const Shape& shape) : compound_(std::get_if<Compound>(&shape)) {
    if (compound_ != nullptr) {
        reach_ = bounding_radius(*compound_);
        return;
    }
    std::visit(
        [this](const auto& each) {
            if constexpr (!std::is_same_v<std::decay_t<decltype(each)>, Compound>) {
                convex_ = internal::view_of(each);
            }
        },
        shape);
    reach_ = reach_of(convex_);
}

ConvexView ShapeView::part(std::uint32_t index) const {
    if (compound_ == nullptr) return convex_;
    return std::visit([](const auto& each) { return internal::view_of(each); },
                      compound_->parts()[index].shape);
}

const Pose* ShapeView::body_from_part(std::uint32_t index) const {
    return compound_ == nullptr ? nullptr : &compound_->parts()[index].body_from_part;
}

void ShapeView::find_bounds() {
    if (compound_ != nullptr) return;
    own_.bounds = std::visit([](const auto& each) { return bounds_of(each); }, convex_);
    own_.item = 0;
    own_.end = 1;
}

std::span<const AabbNode> ShapeView::tree() const {
    return compound_ == nullptr ? std::span(&own_, 1) : part_tree(*compound_);
}

Eigen::Matrix3d part_rotation(const Eigen::Matrix3d& body, const Pose& body_from_part) {
    const Eigen::Matrix3d& part = body_from_part.rotation;
    if (part == Eigen::Matrix3d::Identity()) return body;
    return orthonormalized(product(body, part));
}

PlacedConvex PlacedView::part(std::uint32_t index) const {
    const Pose* pose = view->body_from_part(index);
    if (pose == nullptr) return place(view->part(index), rotation, centre);
    return place(view->part(index), part_rotation(rotation, *pose),
                 centre + rotated(rotation, pose->translation));
}

namespace {

// Distance of two boxes aligned with one frame, or minus their smallest overlap along its axes.
// @param offset between the centres
double gap_of(const Eigen::Vector3d& offset, const Eigen::Vector3d& half_a,
              const Eigen::Vector3d& half_b) {
    double square = 0.0;
    double widest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
        const double gap = std::abs(offset[i]) - (half_a[i] + half_b[i]);
        widest = std::max(widest, gap);
        if (gap > 0.0) square += gap * gap;
    }
    return widest > 0.0 ? std::sqrt(square) : widest;
}

}  // namespace

BoundGaps::BoundGaps(const PlacedView& a, const PlacedView& b) {
    const Eigen::Vector3d offset = b.centre - a.centre;
    for (int j = 0; j < 3; ++j) a_from_b_.col(j) = rotated_back(a.rotation, b.rotation.col(j));
    spread_ = a_from_b_.cwiseAbs();
    offset_ = rotated_back(a.rotation, offset);
    rounding_ = 1e-14 * (a.view->reach() + b.view->reach() + length(offset));
}

double BoundGaps::operator()(const Aabb& of_a, const Aabb& of_b) const {
    const Eigen::Vector3d half_a = 0.5 * (of_a.high - of_a.low);
    const Eigen::Vector3d half_b = 0.5 * (of_b.high - of_b.low);
    const Eigen::Vector3d offset =
        rotated(a_from_b_, 0.5 * (of_b.low + of_b.high)) + offset_ - 0.5 * (of_a.low + of_a.high);
    const double in_a = gap_of(offset, half_a, rotated(spread_, half_b));
    const double in_b =
        gap_of(rotated_back(a_from_b_, offset), rotated_back(spread_, half_a), half_b);
    return std::max(in_a, in_b) - rounding_;
}

PartGap find_least_gap(const PlacedView& a, const PlacedView& b, double limit) {
    PartGap best;
    best.gap.distance = std::numeric_limits<double>::infinity();
    visit_part_pairs(a.view->tree(), b.view->tree(), limit, BoundGaps(a, b),
                     [&](std::uint32_t i, std::uint32_t j, double) {
                         const Gap gap = find_gap(a.part(i), b.part(j));
                         const bool is_tie = gap.distance == best.gap.distance &&
                                             std::pair(i, j) < std::pair(best.part_a, best.part_b);
                         if (gap.distance < best.gap.distance || is_tie) best = {i, j, gap};
                         return std::min(limit, best.gap.distance);
                     });
    return best;
}

// Sources: A. Yuille, A. Rangarajan. The concave-convex procedure. Neural Computation 2003 (the exterior of a convex
//          obstacle is replaced by a half-space, iteratively).
//          S. Cameron, R. Culley. Determining the minimum translational distance between two convex polyhedra. 1986
//          (the obstacle of a pair of parts is their Minkowski difference).
// Deviations: obstacles are not constructed: the signed distance and normal of a pair give the half-space. The
//             iteration starts from the first free (separating) translation along each of a fan of directions.

namespace {

// Half-space of the translations after which a plane separates two parts whose gap after `translation` is `gap`.
HalfSpace half_space(const Eigen::Vector3d& normal, double gap,
                     const Eigen::Vector3d& translation) {
    return {normal, dot(normal, translation) - gap};
}

class Search {
public:
    Search(const PlacedView& a, const PlacedView& b, const PartGap& deepest, double touch)
        : a_(a), b_(b), touch_(touch), deepest_(deepest) {}

    PartGap least_gap(const Eigen::Vector3d& translation) const {
        return find_least_gap(a_.moved(translation), b_, -touch_);
    }
    bool is_free(const PartGap& gap) const { return gap.gap.distance >= -touch_; }

    SeparatingTranslation from_inside() const {
        constexpr int kRounds = 24;
        SeparatingTranslation found;
        found.least = -deepest_.gap.distance;
        PartGap gap = deepest_;
        for (int round = 0; round < kRounds && leave(gap, found); ++round) {
            gap = least_gap(found.translation);
            found.is_found = is_free(gap);
            if (found.is_found) break;
        }
        return found;
    }

    // Shortens a free translation iteratively; all iterates are free.
    Eigen::Vector3d shorten(Eigen::Vector3d translation) const {
        constexpr int kRounds = 24;
        constexpr int kPlanes = 40;
        for (int round = 0; round < kRounds; ++round) {
            HalfSpaces spaces;
            Eigen::Vector3d next = Eigen::Vector3d::Zero();
            bool is_there = false;
            for (int i = 0; i < kPlanes; ++i) {
                const PartGap gap = i == 0 ? deepest_ : least_gap(next);
                is_there = is_free(gap);
                if (is_there) break;
                spaces.add(plane_between(gap.part_a, gap.part_b, translation));
                if (!find_shortest(spaces, next)) break;
            }
            const double before = length(translation);
            if (!is_there || !(length(next) < before)) return translation;
            translation = next;
            if (before - length(next) < 1e-13 * before) return translation;
        }
        return translation;
    }

    // Length of the first free translation found along a direction. Returns `far`, which must be free, if it finds none
    // that is at most `enough`.
    double first_free(const Eigen::Vector3d& direction, double far, double enough) const {
        constexpr int kRounds = 64;
        double at = 0.0;
        PartGap gap = deepest_;
        for (int round = 0; round < kRounds; ++round) {
            const double exit = exit_of(gap.part_a, gap.part_b, direction, far);
            if (!(exit > at)) return far;
            at = exit;
            if (at > enough) return far;
            gap = least_gap(at * direction);
            if (is_free(gap)) return at;
        }
        return far;
    }

    /// Distance along a direction after which the shapes' bounding boxes are separated.
    double bound_distance(const Eigen::Vector3d& direction) const {
        return support(a_, -direction) + support(b_, direction) +
               dot(b_.centre - a_.centre, direction);
    }

private:
    static double support(const PlacedView& shape, const Eigen::Vector3d& direction) {
        const Aabb& box = shape.view->tree()[0].bounds;
        const Eigen::Vector3d n = rotated_back(shape.rotation, direction);
        double reach = 0.0;
        for (int i = 0; i < 3; ++i) reach += n[i] * (n[i] > 0.0 ? box.high[i] : box.low[i]);
        return reach;
    }

    // Adds a half-space of translations that separate an overlapping pair of parts: of several candidates, the one with
    // the shortest solution. False if none is feasible.
    bool leave(const PartGap& gap, SeparatingTranslation& found) const {
        HalfSpaces best;
        Eigen::Vector3d shortest = Eigen::Vector3d::Zero();
        bool is_solved = false;
        const auto add_plane = [&](const HalfSpace& plane) {
            if (!(dot(plane.normal, found.translation) < plane.depth)) return;
            HalfSpaces spaces = found.spaces;
            spaces.add(plane);
            Eigen::Vector3d translation;
            if (!find_shortest(spaces, translation)) return;
            // Nearly opposite planes have solutions that are useless: longer than the separation of the bounding boxes.
            const double size = length(translation);
            if (!(size <= bound_distance(translation / size) + 4.0 * touch_)) return;
            if (is_solved && !(dot(translation, translation) < dot(shortest, shortest))) return;
            is_solved = true;
            shortest = translation;
            best = spaces;
        };
        // Candidates: the planes that separate the pair at this translation and at the start. If neither is feasible,
        // the plane at the exit along the translation.
        add_plane(half_space(gap.gap.normal, gap.gap.distance, found.translation));
        if (found.spaces.count > 0) {
            const Gap at_start = find_gap(a_.part(gap.part_a), b_.part(gap.part_b));
            if (at_start.distance < 0.0) {
                add_plane(half_space(at_start.normal, at_start.distance, Eigen::Vector3d::Zero()));
            }
            if (!is_solved) {
                const Eigen::Vector3d ahead = found.translation / length(found.translation);
                const double far = bound_distance(ahead) + 4.0 * touch_;
                const double exit = exit_of(gap.part_a, gap.part_b, ahead, far);
                add_plane(plane_between(gap.part_a, gap.part_b, exit * ahead));
            }
        }
        if (!is_solved) return false;
        // If the oldest plane was dropped, drop its pair too.
        if (found.spaces.count == HalfSpaces::kMost) {
            std::move(found.parts.begin() + 1, found.parts.end(), found.parts.begin());
        }
        found.spaces = best;
        found.parts[best.count - 1] = {gap.part_a, gap.part_b};
        found.translation = shortest;
        return true;
    }

    // Half-space of a plane that separates two parts after a translation: of two such planes, the one with the smaller
    // depth.
    HalfSpace plane_between(std::uint32_t i, std::uint32_t j,
                            const Eigen::Vector3d& translation) const {
        const PlacedConvex at_a = a_.moved(translation).part(i);
        const PlacedConvex at_b = b_.part(j);
        const Gap gap = find_gap(at_a, at_b);
        HalfSpace best = half_space(gap.normal, std::max(gap.distance, 0.0), translation);
        if (has_radius(at_a) || has_radius(at_b)) return best;
        const Axis facet = find_pseudodistance(at_a, at_b);
        const HalfSpace other = half_space(facet.normal, facet.gap, translation);
        return facet.gap >= 0.0 && other.depth < best.depth ? other : best;
    }

    static bool has_radius(const PlacedConvex& shape) {
        return std::holds_alternative<PlacedSphere>(shape) ||
               std::holds_alternative<PlacedCapsule>(shape);
    }

    // Length along a direction after which two parts no longer overlap. Newton's method converges from outside, because
    // the signed distance of the parts is convex along the direction.
    double exit_of(std::uint32_t i, std::uint32_t j, const Eigen::Vector3d& direction,
                   double far) const {
        constexpr int kSteps = 40;
        const PlacedConvex at_b = b_.part(j);
        double at = far;
        for (int step = 0; step < kSteps; ++step) {
            const Gap gap = find_gap(a_.moved(at * direction).part(i), at_b);
            const double rate = dot(gap.normal, direction);
            if (gap.distance <= 0.5 * touch_ || !(rate > 0.0)) break;
            at -= gap.distance / rate;
        }
        return at;
    }

    const PlacedView& a_;
    const PlacedView& b_;
    double touch_;
    PartGap deepest_;
};

// Directions: a grid of points on the surface of a cube.
constexpr std::array<std::array<double, 3>, 98> make_fan() {
    std::array<std::array<double, 3>, 98> fan{};
    std::size_t count = 0;
    for (int x = -2; x <= 2; ++x) {
        for (int y = -2; y <= 2; ++y) {
            for (int z = -2; z <= 2; ++z) {
                if (x * x != 4 && y * y != 4 && z * z != 4) continue;
                fan[count++] = {double(x), double(y), double(z)};
            }
        }
    }
    return fan;
}
constexpr std::array<std::array<double, 3>, 98> kFan = make_fan();

// The shortest few translations, in order.
struct Shortlist {
    static constexpr std::size_t kMost = 6;
    std::array<Eigen::Vector3d, kMost> translations;
    std::size_t count = 0;

    /// Limit above which translations are not kept.
    double longest() const {
        return count < kMost ? std::numeric_limits<double>::infinity()
                             : length(translations[kMost - 1]);
    }

    void add(const Eigen::Vector3d& translation) {
        std::size_t at = count;
        while (at > 0 &&
               dot(translation, translation) < dot(translations[at - 1], translations[at - 1]))
            --at;
        if (at == kMost) return;
        count = std::min(count + 1, kMost);
        for (std::size_t i = count - 1; i > at; --i) translations[i] = translations[i - 1];
        translations[at] = translation;
    }
};

}  // namespace

SeparatingTranslation grow_separating_translation(const PlacedView& a, const PlacedView& b,
                                                  const PartGap& deepest, double touch) {
    return Search(a, b, deepest, touch).from_inside();
}

SeparatingTranslation find_separating_translation(const PlacedView& a, const PlacedView& b,
                                                  const PartGap& deepest, double touch) {
    const Search search(a, b, deepest, touch);
    SeparatingTranslation best = search.from_inside();
    const double enough = best.least * (1.0 + 1e-12) + touch;
    if (best.is_found && length(best.translation) <= enough) return best;
    Shortlist starts;
    if (best.is_found) starts.add(best.translation);
    for (const PlacedView* shape : {&a, &b}) {
        for (const std::array<double, 3>& ray : kFan) {
            Eigen::Vector3d n = rotated(shape->rotation, {ray[0], ray[1], ray[2]});
            n /= length(n);
            // Slightly beyond the separation of the bounding boxes, so that the translation is free despite rounding.
            const double far = search.bound_distance(n) + 4.0 * touch;
            starts.add(search.first_free(n, far, starts.longest()) * n);
        }
    }
    for (std::size_t i = 0; i < starts.count; ++i) {
        const Eigen::Vector3d translation = search.shorten(starts.translations[i]);
        if (!best.is_found ||
            dot(translation, translation) < dot(best.translation, best.translation)) {
            best.translation = translation;
            best.is_found = true;
            best.spaces.count = 0;
        }
    }
    return best;
}

namespace {

constexpr std::size_t kMostNormals = 24;
// 1 - cosine of the largest angle between normals that count as equal: a microradian.
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

    /// Whether there is a contact with the plane's normal that is as deep as the plane, up to `touch`.
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

    // A new patch. If there are too many, it replaces the shallowest; null if that is not shallower than the contact.
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

// The deepest contact of two parts along the normal of a separating plane.
PairContact deepest_contact(const PlacedView& a, std::uint32_t i, const PlacedView& b,
                            std::uint32_t j, const HalfSpace& plane) {
    const SupportPoint on_a = support_point(a.part(i), -plane.normal);
    const SupportPoint on_b = support_point(b.part(j), plane.normal);
    return {on_a.point, plane.normal, plane.depth, on_a.feature, on_b.feature, i, j};
}

}  // namespace

CompoundContacts find_compound_contacts(const PlacedView& a, const PlacedView& b, double margin,
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
    const PlacedView separated = a.moved(translation);
    const double distance = length(translation);
    Patches patches;
    // Adds the contacts that a pair has after the separating translation, with the depths that they have before it.
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
                             add(i, j,
                                 distance == 0.0 ? gap : find_gap(separated.part(i), b.part(j)));
                         }
                         return reported;
                     });
    if (distance == 0.0) return patches.finish(contacts_out);
    // Adds contacts for active planes that have none after the translation, as with round parts and at corners.
    bool is_all = separation.spaces.count > 0;
    for (std::size_t k = 0; k < separation.spaces.count; ++k) {
        const HalfSpace& plane = separation.spaces.planes[k];
        const bool is_active =
            dot(plane.normal, translation) <= plane.depth + 1e-9 * distance + touch;
        if (!is_active || patches.has(plane, touch)) continue;
        const auto [i, j] = separation.parts[k];
        if (plane.depth >= -reported) {
            patches.add(deepest_contact(a, i, b, j, plane));
        } else {
            is_all = false;  // the parts are too far apart for a contact
        }
    }
    // If an active plane still has no contact, one contact along the translation itself represents all.
    const HalfSpace whole{translation / distance, distance};
    if (!is_all && !patches.has(whole, touch)) {
        patches.add(deepest_contact(a, least.part_a, b, least.part_b, whole));
    }
    return patches.finish(contacts_out);
}

}  // namespace terrane::internal
