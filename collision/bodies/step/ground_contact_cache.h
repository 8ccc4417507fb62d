// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/contact_solver.h"
#include "bodies/solver/rigid_body.h"

#include <terrane/collision/ground_contact.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// How far gates are lowered, in tolerances: from a quarter of it, in ever smaller steps, almost to all of it. There
/// is a next gate for every body that was stopped at one, so that nothing that moves away is ever held.
inline constexpr double kFirstGate = 0.25;
inline constexpr int kGateCount = 48;
/// Where the cast stops above its gate at most, in tolerances. Far below a gate's step, so that a stopped
/// body is clear of the next gate on slopes up to 86 degrees.
inline constexpr double kStopGap = 1.0 / 256.0;
/// Where bodies rest above the first gate, in tolerances: on the surface itself, so that what was put there stays,
/// and above every stop, so that sliding is free.
inline constexpr double kRestGap = kFirstGate;
/// The gap that bodies are separated to, in tolerances: less than what has been put on a slope of 60 degrees has.
inline constexpr double kSeparationGap = 0.5 * kRestGap;
/// Contacts are looked for this far above the gate, in tolerances.
inline constexpr double kContactMargin = 1.0 / 2.0;

/// How far the surface is lowered for a gate, metres.
double lowering(const RigidBody& body, int gate);
/// Lowering the surface is asked for as raising what meets it.
Pose raised(Pose pose, double height);

/// What a body has met on the surface that a gate lowers, as far as contacts are looked for. A body that has
/// hardly moved since takes its contacts along instead of looking again: each stays with its plane.
class GroundLook {
public:
    static constexpr std::size_t kMaxCount = 64;  ///< of contacts, of all parts

    /// Looks through the first gate; or takes the last look along where it was through the first gate, and the
    /// body has moved so little since that nothing else can have come near.
    void update(const RigidBody& body, const Ground& ground);

    /// Looks from where the body is.
    void look(const RigidBody& body, const Ground& ground, int gate);

    /// For a body that is known to be far from all ground wherever it moves until the next look.
    void see_nothing();

    /// Looks again the next time; to be called where the ground may be another one.
    void forget() { is_kept_ = false; }
    /// The same at the start of a step that undo_step() may take back: then the impulses are those of now again.
    void begin_step() {
        forget();
        contacts_at_start_ = contacts_;
    }
    void undo_step() {
        forget();
        contacts_ = contacts_at_start_;
    }

    bool is_resident() const { return resident_; }
    bool has_contacts() const { return !contacts_.empty(); }
    std::size_t count() const { return contacts_.size(); }
    /// Whether the contacts, and their normals, are those of the look before.
    bool has_same_contacts() const { return is_same_; }
    /// At least the largest lift of the parts at the gate that was asked for, metres.
    double lift() const { return lift_ + moved_; }
    /// How far every point of the body may move without coming near the surface of a gate, which is lower by
    /// `further`, metres: at most half of the least gap. 0 or less where nobody knows.
    double free_way(const RigidBody& body, double further) const;

    /// Smallest gap of the contacts if the surface were lower by `further`; `most` where all are wider.
    double least_gap(double further, double most) const;

    /// A contact, for a solver that knows the body by this index.
    SolverContact contact(std::size_t i, const RigidBody& body, std::uint32_t index) const;

    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        contacts_[i].impulse = impulse;
    }

private:
    struct Place {
        ShapeFeature feature;
        std::uint32_t part;
        std::uint32_t piece;        // of the part, where that is a compound
        Eigen::Vector3d impulse;    // of the last substep, N s
        Eigen::Vector3d core_body;  // the point that turning carries round
        Eigen::Vector3d normal;
        double gap;       // now
        double gap_seen;  // when it was looked at
        Eigen::Vector3d core_seen;
        double rounding;
    };
    void follow(const RigidBody& body);
    const Place* find_before(const Place& place) const;

    std::vector<Place> contacts_, contacts_before_, contacts_at_start_;
    Pose pose_seen_;
    double lift_ = -1.0;
    double moved_ = 0.0;
    bool resident_ = true;
    bool is_kept_ = false;
    bool is_same_ = false;
    bool is_far_ = false;
    bool is_whole_ = false;  // it has all contacts, and ground everywhere below and above the body
};

}  // namespace terrane::internal
