// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/contact_solver.h"
#include "bodies/solver/rigid_body.h"

#include <terrane/collision/ground_contact.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::internal {

/// Offset surfaces: the contact surface lowered by a share of the body's tolerance, from a quarter of it in ever
/// smaller steps to almost all of it. A body that was stopped at one surface starts clear of the next, so that it can
/// always move away.
inline constexpr double kFirstOffset = 0.25;
inline constexpr int kOffsetCount = 48;
/// Largest gap at which a cast stops above its offset surface, in tolerances. Far below the step between two surfaces,
/// so that a stopped body is clear of the next one on slopes up to 86 degrees.
inline constexpr double kStopGap = 1.0 / 256.0;
/// Gap at which bodies rest above the first offset surface, in tolerances: on the contact surface itself, so that a
/// body placed on it stays, and above every stop, so that it can slide.
inline constexpr double kRestGap = kFirstOffset;
/// Gap that separation restores, in tolerances: less than that of a body placed on a slope of 60 degrees.
inline constexpr double kSeparationGap = 0.5 * kRestGap;
/// Contacts are searched up to this gap above the offset surface, in tolerances.
inline constexpr double kContactMargin = 1.0 / 2.0;

/// Depth of an offset surface below the contact surface, metres.
double offset_depth(const RigidBody& body, int index);
/// A pose moved up. Queries against a lowered surface are queries of the raised shape.
Pose raised(Pose pose, double height);

/// Beside volumes the surface is not lowered, the body is shrunk: then offsets hold for ceilings and walls too.
struct MeshOffset {
    bool is_missing = false;  ///< ground that is not resident may be near
    int index = 0;            ///< the first at which the shrunk body is clear; kOffsetCount: none
    double distance = 0.0;    ///< lower bound of its distance from all triangles there, metres
};

/// Finds the first offset, from one on, at which a body beside volumes is clear by the stop gap, if any is.
MeshOffset find_mesh_offset(const RigidBody& body, const Ground& ground, int from);

/// The contacts of one body with an offset surface. Reuses them while the body has moved less than the reuse distance:
/// each contact then keeps its plane, and only its gap is updated.
class GroundContactCache {
public:
    static constexpr std::size_t kMaxCount = 64;

    /// Updates the gaps where the cached contacts are still valid, else calls refresh() for the first offset surface.
    /// @param travel how far the body may move until the next refresh, metres: triangles of volumes count where it may
    ///               meet one on the way
    void update(const RigidBody& body, const Ground& ground, double travel = 0.0);

    /// Finds the contacts at the body's pose.
    /// @param reach contacts are searched farther than the contact margin by this, metres: how far the body may move
    ///              until the next refresh
    void refresh(const RigidBody& body, const Ground& ground, int offset_index,
                 double reach = 0.0) {
        find(body, ground, offset_index, reach, 0.0, false);
    }
    /// refresh() for the first offset surface at the start of a collision step. The gate of the step before may have
    /// proved that the body does not penetrate it: then it is not tested again.
    /// @param ground_before that of the step before, null if there was none
    /// @param travel        as of update()
    void refresh_for_step(const RigidBody& body, const Ground& ground, const Ground* ground_before,
                          double reach, double travel);

    /// Remembers that the gate has proved the body clear of the first offset surface at its pose, until the next
    /// collision step.
    void set_proved_clear(const RigidBody& body) { clear_pose_ = body.pose; }
    void forget_proof() { clear_pose_.reset(); }

    /// Updates the gaps for a body that has moved since the refresh: each contact keeps its plane.
    void follow(const RigidBody& body);

    /// Empties the cache of a body that cannot come near the ground until the next update.
    void set_out_of_reach();

    /// As a new cache, but for its memory.
    void reset();

    /// Makes the next update() find contacts anew; needed where the ground may have changed.
    void invalidate() { is_reusable_ = false; }
    /// invalidate() at the start of a step, and remembers the impulses for undo_step().
    void begin_step() {
        invalidate();
        step_start_contacts_ = contacts_;
    }
    void undo_step() {
        invalidate();
        forget_proof();
        contacts_ = step_start_contacts_;
    }

    bool is_resident() const { return resident_; }
    bool has_contacts() const { return !contacts_.empty(); }
    bool is_out_of_reach() const { return is_out_of_reach_; }
    /// Whether the smallest gap is within the contact margin.
    bool is_near(const RigidBody& body) const;
    std::size_t count() const { return contacts_.size(); }
    /// Whether the last refresh found the same contacts and normals as the one before.
    bool has_same_contacts() const { return is_same_; }
    /// Upper bound of the lift over the refreshed offset surface, metres.
    double lift() const { return lift_ + moved_; }
    /// Distance that every point of the body may move without coming near an offset surface that is lower by
    /// `extra_offset`, metres: at most half of the smallest gap. <= 0 where that is unknown.
    double clear_distance(double extra_offset) const;

    /// Whether the last refresh was beside volumes, against triangles.
    bool is_on_mesh() const { return is_on_mesh_; }
    /// There: the first offset, from that of the refresh on, at which the shrunk body is clear; kOffsetCount if none.
    int mesh_offset() const { return mesh_offset_.index; }
    /// There: a lower bound of the shrunk body's distance from all triangles, metres.
    double mesh_distance() const { return mesh_offset_.distance - moved_; }

    /// Smallest gap of the contacts, at most `limit`, if the surface were lower by `extra_offset`, metres.
    double least_gap(double extra_offset, double limit) const;

    /// Gap of contact i, metres.
    double gap(std::size_t i) const { return contacts_[i].gap; }

    /// Contact i for the solver.
    /// @param index the body's index in the solver
    SolverContact contact(std::size_t i, const RigidBody& body, std::uint32_t index) const;

    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        contacts_[i].impulse = impulse;
    }

    /// The fields that a copy needs between two steps, which are those that refresh() reads of the contacts before, for
    /// a stream that writes or reads them (world/world_bytes.h).
    /// @param cache a GroundContactCache, const where the stream writes
    template <class Stream, class Cache>
    static void list_fields(Stream& stream, Cache& cache) {
        stream.list("ground contacts", cache.contacts_, kFieldBytes, [&stream](auto& contact) {
            stream.feature(contact.feature);
            stream.word("part", contact.part);
            stream.impulse("impulse", contact.impulse);
            stream.unit("normal", contact.normal);
        });
    }

private:
    /// The core point of a contact is its point on the shape moved inside by the radius of a sphere or capsule.
    struct CachedContact {
        ShapeFeature feature;
        std::uint32_t part;         // of a compound
        Eigen::Vector3d impulse;    // of the last substep, N s
        Eigen::Vector3d core_body;  // core point, body frame
        Eigen::Vector3d normal;
        double gap;                    // now
        double refresh_gap;            // at the last refresh
        Eigen::Vector3d refresh_core;  // core point at the last refresh, world
        double opening;                // how fast the gap grows with the offset
        double rounding;
        double friction, restitution;  // of the body on the ground's surface there
    };
    static constexpr std::size_t kFieldBytes = 60;  // of a contact in list_fields()
    void find(const RigidBody& body, const Ground& ground, int offset_index, double reach,
              double travel, bool is_clear);
    ContactAnswer find_on_mesh(const RigidBody& body, const Ground& ground, int offset_index,
                               std::span<Contact> contacts_out, std::span<double> openings_out);
    const CachedContact* find_previous(const CachedContact& contact) const;

    std::vector<CachedContact> contacts_, previous_contacts_, step_start_contacts_;
    Pose refresh_pose_;
    std::optional<Pose> clear_pose_;  // see set_proved_clear()
    double lift_ = -1.0;
    double moved_ = 0.0;   // since the refresh: upper bound for every point
    double margin_ = 0.0;  // gap up to which the refresh searched, metres
    bool resident_ = true;
    bool is_reusable_ = false;
    bool is_same_ = false;
    bool is_out_of_reach_ = false;
    bool is_on_mesh_ = false;
    MeshOffset mesh_offset_;
    bool is_exhaustive_ =
        false;  // holds all contacts, and there is ground everywhere below and above the body
};

}  // namespace terrane::internal
