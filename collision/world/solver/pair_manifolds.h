// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/contact_solver.h"
#include "world/solver/rigid_body.h"

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shape_pairs.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Pairs that were found separated, with a lower bound of their distance that decreases as the bodies move: while it
/// exceeds the reach of contacts, a pair needs no narrowphase. All pairs are given in ascending order.
class SeparatedPairs {
public:
    /// Begins a collision step: bodies may have moved, or been placed anew.
    void begin(std::span<const RigidBody> bodies);

    /// Whether a pair is known to be farther apart than `reach` metres. It is then kept for the next step.
    bool is_clear(const BodyPair& pair, double reach);

    /// Adds a pair that was found separated in this step, by at least `distance` metres.
    void add(const BodyPair& pair, double distance);

    /// Ends the step.
    void end();

    /// Forgets the pairs of a body whose shape may have changed.
    void forget(std::uint32_t body) {
        std::erase_if(entries_, [body](const Entry& entry) {
            return entry.pair.a == body || entry.pair.b == body;
        });
    }

private:
    struct Entry {
        BodyPair pair;
        double travel;  // of both bodies, at which their distance may be 0, metres
    };
    double travel_of(const BodyPair& pair) const { return travel_[pair.a] + travel_[pair.b]; }

    std::vector<Entry> entries_, kept_, added_;
    std::size_t next_ = 0;  // of entries_
    std::vector<double>
        travel_;               // [bodies] sum of upper bounds of how far a point has moved, metres
    std::vector<Pose> poses_;  // [bodies] at the last begin()
};

/// Contact manifold of two bodies: up to four contacts of one normal, touching now or within a collision step. Two
/// convex bodies have one manifold, compounds several in consecutive elements. Contacts are reused while the relative
/// motion is below the reuse distance; impulses are kept from substep to substep for the warm start.
class PairManifold {
public:
    static constexpr std::size_t kMaxCount = 4;
    /// Manifolds of one pair; those with the deepest contacts are kept.
    static constexpr std::size_t kMaxManifolds = 8;

    BodyPair pair;

    /// Number of manifolds that a pair needs room for.
    static std::size_t max_count(const RigidBody& a, const RigidBody& b);

    /// Finds the contacts of two bodies, or updates the gaps of the previous ones.
    /// @param manifolds of this pair; unused ones come last, without contacts
    /// @param before    those of the same pair in the previous collision step, or none
    /// @param duration  of the motion ahead, seconds
    static void update(std::span<PairManifold> manifolds, const RigidBody& a, const RigidBody& b,
                       std::span<const PairManifold> before, double duration);

    /// Updates the gaps for bodies that have moved since update(): each contact keeps its normal and its points.
    void follow(const RigidBody& a, const RigidBody& b);

    std::size_t count() const { return count_; }
    /// Gap of contact i at the bodies' poses, metres.
    double gap(std::size_t i, const RigidBody& a, const RigidBody& b) const;
    /// Contacts with at most this gap touch, metres.
    static double touching_gap(const RigidBody& a, const RigidBody& b);

    /// Where update() has found no contacts: a lower bound of the bodies' distance, metres, <= 0 where it is unknown.
    double least_distance() const { return least_distance_; }

    /// Gap beyond which bodies cannot touch in a time, and update() finds no contacts, metres.
    static double contact_reach(const RigidBody& a, const RigidBody& b, double duration);

    /// Gap of contact i for a solver since the last follow(), metres: at most 0 where the bodies touch.
    double solved_gap(std::size_t i, const RigidBody& a, const RigidBody& b) const;
    /// Contact i for a solver that names bodies by the indices of `pair`.
    SolverContact contact(std::size_t i, const RigidBody& a, const RigidBody& b) const;

    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        points_[i].impulse = impulse;
    }

    /// The fields that a copy needs, for a stream that writes or reads them (world/world_bytes.h).
    /// @param manifold a PairManifold, const where the stream writes
    template <class Stream, class Manifold>
    static void list_fields(Stream& stream, Manifold& manifold);

private:
    struct Point {
        // Core points: the contact's points moved inside by the radius of a sphere or capsule; body frames.
        Eigen::Vector3d core_a_body, core_b_body;
        ShapeFeature feature_a, feature_b;
        std::uint32_t part_a = 0, part_b = 0;
        double gap = 0.0;
        double gap_offset = 0.0;  // gap less the core points' separation when the contact was found
        Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // of the last substep, on a, N s
    };
    /// From the bodies' centres to the core points, world.
    struct Arms {
        Eigen::Vector3d a, b;
    };
    static bool has_moved(const RigidBody& a, const RigidBody& b, const PairManifold& before);
    static void collide(std::span<PairManifold> manifolds, const RigidBody& a, const RigidBody& b,
                        double margin, std::span<PairContact> room);
    static void predict_impact(std::span<PairManifold> manifolds, const RigidBody& a,
                               const RigidBody& b, double duration);
    double least_gap() const;
    void reset(const RigidBody& a, const RigidBody& b, const PairContact& first, bool is_predicted);
    Arms arms_of(const PairContact& contact, const WorldPos& centre_a,
                 const WorldPos& centre_b) const;
    void add_point(const PairContact& contact, const RigidBody& a, const RigidBody& b,
                   const Arms& arms, double gap);
    void warm_start(std::span<const PairManifold> before);
    double core_separation(const RigidBody& a, const RigidBody& b, const Point& point) const;

    std::uint32_t count_ = 0;
    double least_distance_ = 0.0;
    bool is_predicted_ = false;  // found by a cast: valid for one collision step
    double rounding_a_ = 0.0, rounding_b_ = 0.0;
    Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();  // out of b
    Pose pose_a_, pose_b_;                               // where the contacts were found
    std::array<Point, kMaxCount> points_;
};

template <class Stream, class Manifold>
void PairManifold::list_fields(Stream& stream, Manifold& manifold) {
    stream.word("body a", manifold.pair.a);
    stream.word("body b", manifold.pair.b);
    stream.integer("contact count", manifold.count_, kMaxCount);
    if (manifold.count_ == 0) return;
    stream.flag("is_predicted", manifold.is_predicted_);
    stream.length("rounding of a", manifold.rounding_a_);
    stream.length("rounding of b", manifold.rounding_b_);
    stream.unit("normal", manifold.normal_);
    stream.pose("pose of a", manifold.pose_a_);
    stream.pose("pose of b", manifold.pose_b_);
    for (std::uint32_t i = 0; i < manifold.count_; ++i) {
        auto& point = manifold.points_[i];
        stream.place("core point of a", point.core_a_body);
        stream.place("core point of b", point.core_b_body);
        stream.feature(point.feature_a);
        stream.feature(point.feature_b);
        stream.word("part of a", point.part_a);
        stream.word("part of b", point.part_b);
        stream.length("gap", point.gap);
        stream.length("gap_offset", point.gap_offset);
        stream.impulse("impulse", point.impulse);
    }
}

}  // namespace terrane::internal
