// SPDX-License-Identifier: MIT
#include "world/island_solver.h"

#include "base/aabb_tree.h"
#include "ground/column/local_shape.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace terrane::internal {
namespace {

/// Exclusive prefix sum: converts counts to group starts.
void accumulate(std::vector<std::uint32_t>& counts) {
    std::uint32_t start = 0;
    for (std::uint32_t& count : counts) {
        const std::uint32_t next = start + count;
        count = start;
        start = next;
    }
}

/// Restores the group starts after the filling of the groups has advanced each start to the end of its group.
void rewind(std::vector<std::uint32_t>& starts) {
    for (std::size_t i = starts.size() - 1; i > 0; --i) starts[i] = starts[i - 1];
    starts[0] = 0;
}

}  // namespace

std::uint32_t Islands::find_root(std::uint32_t body) {
    while (parents_[body] != body) {
        parents_[body] = parents_[parents_[body]];
        body = parents_[body];
    }
    return body;
}

void Islands::build(std::span<const BodyPair> links, std::span<const std::uint8_t> moves) {
    parents_.resize(moves.size());
    std::iota(parents_.begin(), parents_.end(), 0u);
    islands_.assign(moves.size(), kNone);
    for (const BodyPair& link : links) {
        if (moves[link.a] == 0 || moves[link.b] == 0) continue;
        const std::uint32_t a = find_root(link.a), b = find_root(link.b);
        // The lowest body is the root.
        parents_[std::max(a, b)] = std::min(a, b);
    }

    body_starts_.assign(1, 0);
    std::uint32_t body_count = 0;
    for (std::uint32_t body = 0; body < moves.size(); ++body) {
        if (moves[body] == 0) continue;
        const std::uint32_t root = find_root(body);
        if (root == body) {
            islands_[body] = static_cast<std::uint32_t>(body_starts_.size() - 1);
            body_starts_.push_back(0);
        } else {
            islands_[body] = islands_[root];
        }
        ++body_starts_[islands_[body]];
        ++body_count;
    }
    accumulate(body_starts_);
    bodies_.resize(body_count);
    for (std::uint32_t body = 0; body < moves.size(); ++body) {
        if (islands_[body] != kNone) bodies_[body_starts_[islands_[body]]++] = body;
    }
    rewind(body_starts_);

    const auto island_of = [&](const BodyPair& link) {
        return islands_[moves[link.a] != 0 ? link.a : link.b];
    };
    link_starts_.assign(body_starts_.size(), 0);
    std::uint32_t link_count = 0;
    for (const BodyPair& link : links) {
        if (island_of(link) == kNone) continue;
        ++link_starts_[island_of(link)];
        ++link_count;
    }
    accumulate(link_starts_);
    links_.resize(link_count);
    for (std::uint32_t link = 0; link < links.size(); ++link) {
        const std::uint32_t island = island_of(links[link]);
        if (island != kNone) links_[link_starts_[island]++] = link;
    }
    rewind(link_starts_);
}

std::span<const std::uint32_t> Islands::bodies(std::size_t island) const {
    return std::span(bodies_).subspan(body_starts_[island],
                                      body_starts_[island + 1] - body_starts_[island]);
}

std::span<const std::uint32_t> Islands::links(std::size_t island) const {
    return std::span(links_).subspan(link_starts_[island],
                                     link_starts_[island + 1] - link_starts_[island]);
}

namespace {

constexpr std::uint32_t kNotFirst = kNone - 1;
/// Threads take pairs in blocks of this size.
constexpr std::size_t kBodyBlock = 32;
/// A scene is a crowd if it has more than kCrowdPairsPerBody pairs per body and more than kLeastCrowdPairs pairs in
/// all. In a crowd, kMaxPartnersInCrowd limits the pairs of each body.
constexpr std::size_t kCrowdPairsPerBody = 32;
constexpr std::size_t kLeastCrowdPairs = 4096;
constexpr std::uint8_t kMaxPartnersInCrowd = 64;

bool is_moved_by_none(Mobility mobility) {
    return mobility != Mobility::moving && mobility != Mobility::prescribed;
}

/// Half extents of a body's bounding box in world axes, metres, valid for its rotations in a step.
Eigen::Vector3d half_box(const RigidBody& body, double duration) {
    const double turn_distance = body.radius * length(body.velocity.angular) * duration;
    const Shape& shape = *body.shape;
    const Eigen::Matrix3d& r = body.pose.rotation;
    Eigen::Vector3d half;
    if (std::holds_alternative<ConvexHull>(shape) || std::holds_alternative<Compound>(shape)) {
        const LocalBody placed(shape, r, Eigen::Vector3d::Zero());
        const LocalShape& whole = placed.whole();
        for (int axis = 0; axis < 3; ++axis) {
            const double reach = std::abs(whole.centre[axis]) + whole.bounds[axis];
            half[axis] = std::min(body.radius, reach + turn_distance);
        }
        return half;
    }
    for (int axis = 0; axis < 3; ++axis) {
        double reach = body.radius;
        if (const auto* box = std::get_if<Box>(&shape)) {
            const Eigen::Vector3d& h = box->half_extents;
            reach = std::abs(r(axis, 0)) * h.x() + std::abs(r(axis, 1)) * h.y() +
                    std::abs(r(axis, 2)) * h.z();
        } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
            reach = capsule->radius + std::abs(r(axis, 2)) * capsule->half_height;
        }
        half[axis] = std::min(body.radius, reach + turn_distance);
    }
    return half;
}

/// Bounds of a body's motion in a step, with the half extents of the body, metres.
Aabb swept_bounds(const RigidBody& body, const Eigen::Vector3d& half, double duration) {
    const double fall = 0.5 * duration * duration * length(body.acceleration);
    const Eigen::Vector3d translation = body.velocity.linear * duration;
    const double margin = body.tolerance + fall;
    const WorldPos& centre = body.pose.translation;
    Aabb bounds;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.low[axis] = centre[axis] - half[axis] - margin + std::min(0.0, translation[axis]);
        bounds.high[axis] = centre[axis] + half[axis] + margin + std::max(0.0, translation[axis]);
    }
    return bounds;
}

Aabb swept_box(const RigidBody& body, double duration) {
    return swept_bounds(body, half_box(body, duration), duration);
}

}  // namespace

void IslandSolver::update_bounds(std::span<const RigidBody> bodies,
                                 std::span<const Mobility> mobility, const StepSpan& span) {
    const double duration = span.duration;
    bounds_.resize(bodies.size());
    has_bounds_.resize(bodies.size(), 0);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        // A still body keeps its box until forget_bounds(). A dynamic body that is `fixed` only for now, such as a
        // parked one, is not still: its state may change without that call.
        const bool is_still = mobility[i] == Mobility::asleep ||
                              (is_moved_by_none(mobility[i]) &&
                               !(is_dynamic(bodies[i]) && mobility[i] == Mobility::fixed));
        if (is_still && has_bounds_[i] != 0) continue;
        has_bounds_[i] = is_still ? 1 : 0;
        if (mobility[i] == Mobility::absent) {
            bounds_[i] = empty_box();
            continue;
        }
        const RigidBody& body = bodies[i];
        bounds_[i] = is_two_scene_ && !is_still
                         ? swept_bounds(body, Eigen::Vector3d::Constant(body.radius), duration)
                         : swept_box(body, duration);
    }
}

/// The pairs whose boxes overlap.
std::span<const BodyPair> IslandSolver::find_pairs(std::span<const RigidBody> bodies,
                                                   double duration) {
    if (!is_two_scene_) return broadphase_->find_pairs();
    return boxes_.find_pairs(*broadphase_, bodies.size(), [&](std::uint32_t i) {
        return has_bounds_[i] != 0 ? bounds_[i] : swept_box(bodies[i], duration);
    });
}

/// Whether one of the bodies already has the most pairs allowed in a crowd. If not, counts the pair.
bool IslandSolver::is_crowded(const BodyPair& pair, bool is_limited) {
    if (!is_limited) return false;
    std::uint8_t &a = partner_count_[pair.a], &b = partner_count_[pair.b];
    if (a >= kMaxPartnersInCrowd || b >= kMaxPartnersInCrowd) {
        ++skipped_pair_count_;
        return true;
    }
    ++a;
    ++b;
    return false;
}

/// Creates the manifolds of all pairs that may touch, and looks up those of the previous collision step.
void IslandSolver::collect_pairs(std::span<const RigidBody> bodies,
                                 std::span<const Mobility> mobility, double duration) {
    std::swap(manifolds_, previous_manifolds_);
    manifolds_.clear();
    previous_index_.clear();
    const auto is_earlier = [](const BodyPair& a, const BodyPair& b) {
        return a.a != b.a ? a.a < b.a : a.b < b.b;
    };
    sensor_pairs_.clear();
    skipped_pair_count_ = 0;
    separated_.begin(bodies);
    std::size_t old = 0;
    const std::span<const BodyPair> pairs = find_pairs(bodies, duration);
    const bool is_crowd =
        pairs.size() > std::max(kLeastCrowdPairs, kCrowdPairsPerBody * bodies.size());
    if (is_crowd) partner_count_.assign(bodies.size(), 0);
    for (const BodyPair& pair : pairs) {
        const RigidBody &a = bodies[pair.a], &b = bodies[pair.b];
        if ((!is_dynamic(a) && !is_dynamic(b)) || !may_collide(a.filter, b.filter)) continue;
        if (a.is_sensor || b.is_sensor) {
            sensor_pairs_.push_back(pair);
            continue;
        }
        const bool rests = is_moved_by_none(mobility[pair.a]) && is_moved_by_none(mobility[pair.b]);
        const double reach = a.radius + b.radius + a.tolerance + b.tolerance +
                             duration * length(a.velocity.linear - b.velocity.linear);
        const Eigen::Vector3d between = a.pose.translation - b.pose.translation;
        if (dot(between, between) > reach * reach) continue;
        while (old < previous_manifolds_.size() &&
               is_earlier(previous_manifolds_[old].pair, pair)) {
            ++old;
        }
        const bool was = old < previous_manifolds_.size() && previous_manifolds_[old].pair == pair;
        if (rests && !was) continue;
        // Not in a crowd: it would change which pairs are skipped, and a loaded world knows no separated pairs.
        if (!was && !is_crowd &&
            separated_.is_clear(pair, PairManifold::contact_reach(a, b, duration))) {
            continue;
        }
        if (pair_filter_ && !pair_filter_(pair.a, pair.b)) continue;
        if (is_crowded(pair, is_crowd)) continue;
        previous_index_.push_back(was ? static_cast<std::uint32_t>(old) : kNone);
        const std::size_t most = PairManifold::max_count(a, b);
        for (std::size_t i = 0; i < most; ++i) manifolds_.emplace_back().pair = pair;
        previous_index_.resize(manifolds_.size(), kNotFirst);
    }
}

/// Removes pairs without contacts and records their distances. Other pairs keep all their manifolds, even empty ones.
void IslandSolver::remove_separated() {
    std::size_t kept = 0;
    bool has_contacts = false;
    for (std::size_t i = 0; i < manifolds_.size(); ++i) {
        const bool is_first = i == 0 || !(manifolds_[i].pair == manifolds_[i - 1].pair);
        if (is_first) has_contacts = manifolds_[i].count() > 0;
        if (!has_contacts) {
            if (is_first) separated_.add(manifolds_[i].pair, manifolds_[i].least_distance());
            continue;
        }
        if (kept != i) manifolds_[kept] = manifolds_[i];
        ++kept;
    }
    manifolds_.resize(kept);
    separated_.end();
}

void IslandSolver::wake(std::span<const std::uint32_t> groups,
                        std::span<const BodyPair> wheel_links, std::span<Mobility> mobility) {
    bool any = false;
    wakes_.assign(mobility.size(), 0);
    const auto wake_sleeper_of = [&](const BodyPair& pair) {
        const auto [a, b] = pair;
        if (mobility[a] == Mobility::asleep && !is_moved_by_none(mobility[b])) {
            wakes_[groups[a]] = 1;
            any = true;
        }
        if (mobility[b] == Mobility::asleep && !is_moved_by_none(mobility[a])) {
            wakes_[groups[b]] = 1;
            any = true;
        }
    };
    for (const PairManifold& manifold : manifolds_) {
        if (manifold.count() > 0) wake_sleeper_of(manifold.pair);
    }
    for (const BodyPair& link : wheel_links) wake_sleeper_of(link);
    if (!any) return;
    for (std::size_t i = 0; i < mobility.size(); ++i) {
        if (mobility[i] == Mobility::asleep && wakes_[groups[i]] != 0) {
            mobility[i] = Mobility::moving;
        }
    }
}

void IslandSolver::find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
                        std::span<const BodyPair> wheel_links, std::span<Mobility> mobility,
                        const StepSpan& span, WorkerTeam& team) {
    const double duration = span.duration;
    if (collide_bodies_ && bodies.size() > 1) {
        update_bounds(bodies, mobility, span);
        broadphase_->update(bounds_);
        collect_pairs(bodies, mobility, duration);
    }
    team.run_blocks(manifolds_.size(), kBodyBlock, [&](std::size_t i) {
        if (previous_index_[i] == kNotFirst) return;  // belongs to the pair's first manifold
        const auto [a, b] = manifolds_[i].pair;
        const std::size_t most = PairManifold::max_count(bodies[a], bodies[b]);
        const std::span<PairManifold> manifolds = std::span(manifolds_).subspan(i, most);
        std::span<PairManifold> previous;
        if (previous_index_[i] != kNone) {
            previous = std::span(previous_manifolds_).subspan(previous_index_[i], most);
        }
        if (is_moved_by_none(mobility[a]) && is_moved_by_none(mobility[b])) {
            std::copy(previous.begin(), previous.end(), manifolds.begin());
        } else {
            PairManifold::update(manifolds, bodies[a], bodies[b], previous, duration);
        }
    });
    remove_separated();
    wake(groups, wheel_links, mobility);

    links_.clear();
    link_manifolds_.clear();
    pair_count_ = 0;
    for (std::size_t i = 0; i < manifolds_.size(); ++i) {
        const BodyPair& pair = manifolds_[i].pair;
        if (mobility[pair.a] != Mobility::moving && mobility[pair.b] != Mobility::moving) continue;
        if (links_.empty() || !(links_.back() == pair)) ++pair_count_;
        links_.push_back(pair);
        link_manifolds_.push_back(static_cast<std::uint32_t>(i));
    }
    for (const BodyPair& link : wheel_links) {
        if (mobility[link.a] != Mobility::moving && mobility[link.b] != Mobility::moving) continue;
        links_.push_back(link);
        link_manifolds_.push_back(kNone);
    }
    moves_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) moves_[i] = mobility[i] == Mobility::moving;
    islands_.build(links_, moves_);
    find_drivers(bodies, mobility, span);
}

/// Computes the poses that the prescribed bodies of the links have in later substeps.
void IslandSolver::find_drivers(std::span<const RigidBody> bodies,
                                std::span<const Mobility> mobility, const StepSpan& span) {
    later_prescribed_.clear();
    prescribed_index_.resize(bodies.size());
    for (const BodyPair& link : links_)
        prescribed_index_[link.a] = prescribed_index_[link.b] = kNone;
    for (const BodyPair& link : links_) {
        for (const std::uint32_t i : {link.a, link.b}) {
            if (mobility[i] != Mobility::prescribed || prescribed_index_[i] != kNone) continue;
            prescribed_index_[i] = static_cast<std::uint32_t>(later_prescribed_.size());
            RigidBody later = bodies[i];
            for (int substep = 1; substep < span.substep_count; ++substep) {
                const Motion motion{later.pose, later.velocity.linear * span.substep(),
                                    later.velocity.angular * span.substep()};
                later.pose = motion.at(1.0);
                later_prescribed_.push_back(later);
            }
        }
    }
}

void IslandSolver::forget_contacts(std::uint32_t body,
                                   const std::function<void(std::uint32_t)>& touched) {
    forget_bounds(body);
    separated_.forget(body);
    std::erase_if(manifolds_, [&](const PairManifold& manifold) {
        const auto [a, b] = manifold.pair;
        if (a != body && b != body) return false;
        touched(a == body ? b : a);
        return true;
    });
}

}  // namespace terrane::internal
