// SPDX-License-Identifier: MIT
// Sources: A. Yuille, A. Rangarajan. The concave-convex procedure. Neural Computation 2003 (the exterior of a convex
//          obstacle is replaced by a half-space, iteratively).
//          S. Cameron, R. Culley. Determining the minimum translational distance between two convex polyhedra. 1986
//          (the obstacle of a pair of parts is their Minkowski difference).
// Deviations: obstacles are not constructed: a pair's signed distance and its normal give the half-space. Starts are
//             the first free translations along a fan of directions.
#include "pairs/compound/separating_translation.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// The half-space of translations after which a plane separates two parts, from their gap after `translation`.
HalfSpace half_space(const Eigen::Vector3d& normal, double gap,
                     const Eigen::Vector3d& translation) {
    return {normal, dot(normal, translation) - gap};
}

class Search {
public:
    Search(const PlacedShape& a, const PlacedShape& b, const PartGap& deepest, double touch)
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

    // Length of the first free translation along a direction; `far` is free. Where it is beyond `enough`, any free one.
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

    /// Translation along a direction after which the shapes' bounds are separated.
    double bound_distance(const Eigen::Vector3d& direction) const {
        return support(a_, -direction) + support(b_, direction) +
               dot(b_.centre - a_.centre, direction);
    }

private:
    static double support(const PlacedShape& shape, const Eigen::Vector3d& direction) {
        const Aabb& box = shape.view->tree()[0].bounds;
        const Eigen::Vector3d n = rotated_back(shape.rotation, direction);
        double reach = 0.0;
        for (int i = 0; i < 3; ++i) reach += n[i] * (n[i] > 0.0 ? box.high[i] : box.low[i]);
        return reach;
    }

    // Adds a half-space in which an overlapping pair of parts is separated: of several the one with the shortest
    // solution. False where none is feasible.
    bool leave(const PartGap& gap, SeparatingTranslation& found) const {
        HalfSpaces best;
        Eigen::Vector3d shortest = Eigen::Vector3d::Zero();
        bool is_solved = false;
        const auto take = [&](const HalfSpace& plane) {
            if (!(dot(plane.normal, found.translation) < plane.depth)) return;
            HalfSpaces spaces = found.spaces;
            spaces.add(plane);
            Eigen::Vector3d translation;
            if (!find_shortest(spaces, translation)) return;
            // Nearly opposite planes have distant solutions: beyond the bounds' separation none is useful.
            const double size = length(translation);
            if (!(size <= bound_distance(translation / size) + 4.0 * touch_)) return;
            if (is_solved && !(dot(translation, translation) < dot(shortest, shortest))) return;
            is_solved = true;
            shortest = translation;
            best = spaces;
        };
        // Candidates: the pair's plane here, its plane at the start, or else a plane at its exit along the translation.
        take(half_space(gap.gap.normal, gap.gap.distance, found.translation));
        if (found.spaces.count > 0) {
            const Gap at_start = find_gap(a_.part(gap.part_a), b_.part(gap.part_b));
            if (at_start.distance < 0.0) {
                take(half_space(at_start.normal, at_start.distance, Eigen::Vector3d::Zero()));
            }
            if (!is_solved) {
                const Eigen::Vector3d ahead = found.translation / length(found.translation);
                const double far = bound_distance(ahead) + 4.0 * touch_;
                const double exit = exit_of(gap.part_a, gap.part_b, ahead, far);
                take(plane_between(gap.part_a, gap.part_b, exit * ahead));
            }
        }
        if (!is_solved) return false;
        // Where the oldest plane was dropped, so is its pair.
        if (found.spaces.count == HalfSpaces::kMost) {
            std::move(found.parts.begin() + 1, found.parts.end(), found.parts.begin());
        }
        found.spaces = best;
        found.parts[best.count - 1] = {gap.part_a, gap.part_b};
        found.translation = shortest;
        return true;
    }

    // A plane that separates two parts after a translation, with the half-space nearest to the start.
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

    // Length along a direction after which two parts no longer overlap: their signed distance is convex along it, and
    // its tangents from outside converge to the exit (Newton).
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

    const PlacedShape& a_;
    const PlacedShape& b_;
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

// The shortest few, in order.
struct Shortlist {
    static constexpr std::size_t kMost = 6;
    std::array<Eigen::Vector3d, kMost> translations;
    std::size_t count = 0;

    /// Longer ones are not kept.
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

SeparatingTranslation grow_separating_translation(const PlacedShape& a, const PlacedShape& b,
                                                  const PartGap& deepest, double touch) {
    return Search(a, b, deepest, touch).from_inside();
}

SeparatingTranslation find_separating_translation(const PlacedShape& a, const PlacedShape& b,
                                                  const PartGap& deepest, double touch) {
    const Search search(a, b, deepest, touch);
    SeparatingTranslation best = search.from_inside();
    const double enough = best.least * (1.0 + 1e-12) + touch;
    if (best.is_found && length(best.translation) <= enough) return best;
    Shortlist starts;
    if (best.is_found) starts.add(best.translation);
    for (const PlacedShape* shape : {&a, &b}) {
        for (const std::array<double, 3>& ray : kFan) {
            Eigen::Vector3d n = rotated(shape->rotation, {ray[0], ray[1], ray[2]});
            n /= length(n);
            // Beyond the touching distance, so that it is free in spite of rounding.
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

}  // namespace terrane::internal
