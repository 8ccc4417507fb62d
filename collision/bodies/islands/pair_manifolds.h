// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/contact_solver.h"
#include "bodies/solver/rigid_body.h"

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shape_pairs.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace terrane::internal {

/// Where two bodies touch, or will within a substep: up to four contacts of one normal. Two convex bodies have one
/// touch, compounds several in a row. While the bodies have hardly moved past each other, the contacts are taken along
/// with them; impulses are kept from substep to substep.
class PairTouch {
public:
    static constexpr std::size_t kMaxCount = 4;
    /// Of two bodies: those with the deepest contacts are kept.
    static constexpr std::size_t kMaxTouches = 8;

    BodyPair pair;

    /// How many touches two bodies may have.
    static std::size_t most(const RigidBody& a, const RigidBody& b);

    /// Looks at two bodies, or takes their contacts of before along.
    /// @param touches  of this pair: those that are not needed come last, without contacts
    /// @param before   those of the same pair a substep ago, or none
    /// @param duration that the bodies will move for, seconds
    static void update(std::span<PairTouch> touches, const RigidBody& a, const RigidBody& b,
                       std::span<const PairTouch> before, double duration);

    /// The same from where they were looked at last in this substep.
    static void update_again(std::span<PairTouch> touches, const RigidBody& a, const RigidBody& b,
                             double duration);

    std::size_t count() const { return count_; }

    /// When bodies first meet that will bounce off each other, as a share of `duration`; 1 where none do.
    double first_impact(const RigidBody& a, const RigidBody& b, double bounce_speed,
                        double duration) const;

    /// A contact for a solver that knows the bodies by their indices.
    SolverContact contact(std::size_t i, const RigidBody& a, const RigidBody& b) const;

    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        points_[i].impulse = impulse;
    }

private:
    struct Point {
        // The points that turning carries round, body frames.
        Eigen::Vector3d core_a_body, core_b_body;
        ShapeFeature feature_a, feature_b;
        std::uint32_t part_a = 0, part_b = 0;
        double gap = 0.0;
        Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // of the last substep, on a, N s
    };
    /// From the bodies' centres to the points that turning carries round, world.
    struct Arms {
        Eigen::Vector3d a, b;
    };
    static bool have_moved(const RigidBody& a, const RigidBody& b, const PairTouch& before);
    static void look(std::span<PairTouch> touches, const RigidBody& a, const RigidBody& b,
                     double margin, std::span<PairContact> room);
    void look_ahead(const RigidBody& a, const RigidBody& b, double duration);
    void begin(const RigidBody& a, const RigidBody& b, const PairContact& first, bool is_ahead);
    Arms arms_of(const PairContact& contact, const WorldPos& centre_a,
                 const WorldPos& centre_b) const;
    Point& take(const PairContact& contact, const RigidBody& a, const RigidBody& b,
                const Arms& arms);
    void take_impulses(std::span<const PairTouch> before);
    void place(const RigidBody& a, const RigidBody& b, Point& point) const;

    std::uint32_t count_ = 0;
    bool is_ahead_ = false;  // found by a cast: good for one substep
    double rounding_a_ = 0.0, rounding_b_ = 0.0;
    Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();  // out of b
    Pose seen_a_, seen_b_;
    std::array<Point, kMaxCount> points_;
};

}  // namespace terrane::internal
