// SPDX-License-Identifier: MIT
#include "world/contact_tracker.h"

#include "base/vector_math.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <tuple>

namespace terrane::internal {
namespace {

/// A ground contact counts as touching up to this gap beyond the rest gap, in tolerances.
constexpr double kTouchingGroundGap = 1.0 / 8.0;

bool has_moved(Mobility mobility) {
    return mobility == Mobility::moving || mobility == Mobility::prescribed;
}

/// Orders by index, the ground last, then by generation.
bool is_before(const TouchingPair& x, const TouchingPair& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
}

}  // namespace

void ContactTracker::begin_step() {
    contacts_.clear();
    events_.clear();
    points_.clear();
}

void ContactTracker::add_impulses(const IslandSolver& islands, std::span<const Mobility> mobility) {
    const std::span<const PairManifold> manifolds = islands.manifolds();
    for (std::size_t i = 0; i < manifolds.size(); ++i) {
        const Eigen::Vector3d& impulse = islands.pair_impulses()[i];
        if (impulse.isZero(0.0)) continue;
        const BodyPair& pair = manifolds[i].pair;
        contacts_.push_back({.a = pair.a, .b = pair.b, .touches = true, .impulse = impulse});
    }
    for (std::uint32_t body = 0; body < mobility.size(); ++body) {
        if (mobility[body] == Mobility::moving) {
            add_ground_impulse(body, islands.ground_impulses()[body]);
        }
    }
}

void ContactTracker::add_ground_impulse(std::uint32_t body, const Eigen::Vector3d& impulse) {
    if (impulse.isZero(0.0)) return;
    contacts_.push_back({.a = body, .b = kNone, .touches = true, .impulse = impulse});
}

void ContactTracker::end_step(const IslandSolver& islands, const Bodies& bodies) {
    find_pairs(islands, bodies);
    find_ground(bodies);
    find_sensors(islands, bodies);
    merge_contacts();
    make_events(bodies);
}

void ContactTracker::add_point(Contact& contact, const SolverContact& point, double gap) {
    points_.push_back({point.point_a, point.normal, gap});
    ++contact.point_count;
    if (!(gap < contact.least_gap)) return;
    contact.least_gap = gap;
    contact.normal = point.normal;
}

/// Finds the contact points of pairs at the end of the step.
void ContactTracker::find_pairs(const IslandSolver& islands, const Bodies& bodies) {
    for (const PairManifold& manifold : islands.manifolds()) {
        const auto [a, b] = manifold.pair;
        if (!has_moved(bodies.mobility[a]) && !has_moved(bodies.mobility[b])) continue;
        const RigidBody &body_a = bodies.bodies[a], &body_b = bodies.bodies[b];
        Contact contact{.a = a, .b = b, .first_point = static_cast<std::uint32_t>(points_.size())};
        for (std::size_t i = 0; i < manifold.count(); ++i) {
            const double gap = manifold.gap(i, body_a, body_b);
            add_point(contact, manifold.contact(i, body_a, body_b), gap);
        }
        contact.touches = contact.least_gap <= PairManifold::touching_gap(body_a, body_b);
        contacts_.push_back(contact);
    }
}

void ContactTracker::find_ground(const Bodies& bodies) {
    for (std::uint32_t a = 0; a < bodies.bodies.size(); ++a) {
        if (bodies.mobility[a] != Mobility::moving) continue;
        const RigidBody& body = bodies.bodies[a];
        GroundContactCache& cache = bodies.gates[a].contacts();
        cache.follow(body);
        Contact contact{
            .a = a, .b = kNone, .first_point = static_cast<std::uint32_t>(points_.size())};
        for (std::size_t i = 0; i < cache.count(); ++i) {
            const SolverContact point = cache.contact(i, body, a);
            // The cache's gaps are relative to an offset surface, from which a body at rest keeps the rest gap.
            add_point(contact, point, point.gap - point.rest_gap);
        }
        contact.touches = contact.least_gap <= kTouchingGroundGap * body.tolerance;
        contacts_.push_back(contact);
    }
}

void ContactTracker::find_sensors(const IslandSolver& islands, const Bodies& bodies) {
    for (const BodyPair& pair : islands.sensor_pairs()) {
        const RigidBody &a = bodies.bodies[pair.a], &b = bodies.bodies[pair.b];
        const bool touches = test_contact(*a.shape, a.pose, *b.shape, b.pose).is_touching;
        contacts_.push_back({.a = pair.a, .b = pair.b, .is_sensor = true, .touches = touches});
    }
}

/// Merges the entries of each pair, in the order in which they were added, and drops pairs that do not touch.
void ContactTracker::merge_contacts() {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        contacts_[i].order = static_cast<std::uint32_t>(i);
    }
    // std::stable_sort would allocate.
    std::sort(contacts_.begin(), contacts_.end(), [](const Contact& x, const Contact& y) {
        return std::tie(x.a, x.b, x.order) < std::tie(y.a, y.b, y.order);
    });
    std::size_t kept = 0;
    for (const Contact& contact : contacts_) {
        Contact* const last = kept > 0 ? &contacts_[kept - 1] : nullptr;
        if (last == nullptr || last->a != contact.a || last->b != contact.b) {
            contacts_[kept++] = contact;
            continue;
        }
        last->touches = last->touches || contact.touches;
        last->impulse += contact.impulse;
        if (contact.point_count == 0) continue;
        if (last->point_count == 0) last->first_point = contact.first_point;
        last->point_count += contact.point_count;
        if (contact.least_gap < last->least_gap) {
            last->least_gap = contact.least_gap;
            last->normal = contact.normal;
        }
    }
    contacts_.resize(kept);
    std::erase_if(contacts_, [](const Contact& contact) { return !contact.touches; });
}

void ContactTracker::make_events(const Bodies& bodies) {
    const auto moved = [&](BodyId body) {
        return bodies.ids.contains(body) && has_moved(bodies.mobility[body.index]);
    };
    std::swap(touching_, touching_before_);
    touching_.clear();
    auto before = touching_before_.begin();
    const auto end_those_before = [&](const TouchingPair* pair) {
        for (; before != touching_before_.end() && (pair == nullptr || is_before(*before, *pair));
             ++before) {
            const bool exists = bodies.ids.contains(before->a) &&
                                (!before->b.is_valid() || bodies.ids.contains(before->b));
            // Contacts of two bodies at rest are not detected again, but continue. Sensors are tested in every step.
            if (exists && !before->is_sensor && !moved(before->a) && !moved(before->b)) {
                touching_.push_back(*before);
            } else {
                make_event(*before, ContactPhase::ended, nullptr);
            }
        }
    };
    for (const Contact& contact : contacts_) {
        const TouchingPair pair{bodies.ids.id(contact.a),
                                contact.b == kNone ? BodyId{} : bodies.ids.id(contact.b),
                                contact.is_sensor};
        end_those_before(&pair);
        const bool stays = before != touching_before_.end() && *before == pair;
        if (stays) ++before;
        touching_.push_back(pair);
        if (!stays) {
            make_event(pair, ContactPhase::began, &contact);
        } else if (moved(pair.a) || moved(pair.b)) {
            make_event(pair, ContactPhase::stayed, &contact);
        }
    }
    end_those_before(nullptr);
}

void ContactTracker::make_event(const TouchingPair& pair, ContactPhase phase,
                                const Contact* contact) {
    ContactEvent event{.a = pair.a, .b = pair.b, .phase = phase, .is_sensor = pair.is_sensor};
    if (contact != nullptr) {
        event.impulse = contact->impulse;
        event.normal = contact->normal;
        event.first_point = contact->first_point;
        event.point_count = contact->point_count;
    }
    events_.push_back(event);
}

}  // namespace terrane::internal
