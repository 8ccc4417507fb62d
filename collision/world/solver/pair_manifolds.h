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

/// Cache of separated pairs with a lower bound of their distance, which decreases as the bodies move. A pair needs no
/// narrowphase while the bound exceeds the reach of contacts. All pairs are passed in ascending order.
class SeparatedPairs {
public:
    /// Starts a collision step: bodies may have moved or been placed anew.
    void begin(std::span<const RigidBody> bodies);

    /// Whether a pair is known to be farther apart than `reach` metres; if so, it is kept for the next step.
    bool is_clear(const BodyPair& pair, double reach);

    /// Adds a pair that was found to be separated by at least `distance` metres in this step.
    void add(const BodyPair& pair, double distance);

    /// Ends the step.
    void end();

    /// Removes the pairs of a body whose shape may have changed.
    void forget(std::uint32_t body) {
        std::erase_if(entries_, [body](const Entry& entry) {
            return entry.pair.a == body || entry.pair.b == body;
        });
    }

private:
    struct Entry {
        BodyPair pair;
        double travel;  // total travel of both bodies at which they may touch, metres
    };
    double travel_of(const BodyPair& pair) const { return travel_[pair.a] + travel_[pair.b]; }

    std::vector<Entry> entries_, kept_, added_;
    std::size_t next_ = 0;  // index of the next entry to compare in is_clear()
    std::vector<double>
        travel_;  // [bodies] upper bound of the distance travelled by any point, metres
    std::vector<Pose> poses_;  // [bodies] at the last begin()
};

/// Contact manifold of two bodies: up to four contacts with a common normal that touch now or may touch within a
/// collision step. Two convex bodies have one manifold, compounds several in consecutive elements. Contacts are reused
/// while the relative motion is below the reuse distance; impulses are kept between substeps for warm starting.
class PairManifold {
public:
    static constexpr std::size_t kMaxCount = 4;
    /// Maximum number of manifolds of a pair; those with the deepest contacts are kept.
    static constexpr std::size_t kMaxManifolds = 8;

    BodyPair pair;

    /// Number of manifolds to reserve for a pair.
    static std::size_t max_count(const RigidBody& a, const RigidBody& b);

    /// Finds the contacts of two bodies, or updates the gaps of the previous ones.
    /// @param manifolds manifolds of this pair; unused ones come last and have no contacts
    /// @param before    manifolds of the pair in the previous collision step, or none
    /// @param duration  of the motion ahead, seconds
    static void update(std::span<PairManifold> manifolds, const RigidBody& a, const RigidBody& b,
                       std::span<const PairManifold> before, double duration);

    /// Updates the gaps after the bodies have moved since update(): contacts keep their normals and points.
    void follow(const RigidBody& a, const RigidBody& b);

    std::size_t count() const { return count_; }
    /// Gap of contact i at the bodies' poses, metres.
    double gap(std::size_t i, const RigidBody& a, const RigidBody& b) const;
    /// Largest gap at which contacts count as touching, metres.
    static double touching_gap(const RigidBody& a, const RigidBody& b);

    /// Lower bound of the bodies' distance if update() found no contacts, metres; <= 0 if unknown.
    double least_distance() const { return least_distance_; }

    /// Largest gap at which bodies may touch within `duration`, metres; update() finds no contacts at larger gaps.
    static double contact_reach(const RigidBody& a, const RigidBody& b, double duration);

    /// Gap of contact i for the solver, taken from the last follow(), metres: at most 0 if the bodies touch.
    double solved_gap(std::size_t i, const RigidBody& a, const RigidBody& b) const;
    /// Contact i for a solver that indexes bodies as in `pair`.
    SolverContact contact(std::size_t i, const RigidBody& a, const RigidBody& b) const;

    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        points_[i].impulse = impulse;
    }

    /// Serialises the fields that a copy needs. See world/world_bytes.h.
    /// @param manifold a PairManifold, const for writing
    template <class Stream, class Manifold>
    static void list_fields(Stream& stream, Manifold& manifold);

private:
    struct Point {
        // Core points: the contact points moved inward by the radius of a sphere or capsule; body frames.
        Eigen::Vector3d core_a_body, core_b_body;
        ShapeFeature feature_a, feature_b;
        std::uint32_t part_a = 0, part_b = 0;
        double gap = 0.0;
        double gap_offset = 0.0;  // gap less the core points' separation when the contact was found
        Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // of the last substep, on a, N s
    };
    /// Vectors from the bodies' centres to the core points, world.
    struct Arms {
        Eigen::Vector3d a, b;
    };
    static bool has_moved(const RigidBody& a, const RigidBody& b, const PairManifold& before);
    static void collide(std::span<PairManifold> manifolds, const RigidBody& a, const RigidBody& b,
                        double margin, std::span<PairContact> buffer);
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
    Pose pose_a_, pose_b_;                               // at which the contacts were found
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
