// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/contact_solver.h"
#include "world/solver/rigid_body.h"

#include <terrane/collision/ground_queries.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::internal {

/// Penetration of a body's deepest part.
struct Depth {
    bool resident = true;
    double depth = 0.0;                                 ///< metres, >= 0
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< escape direction
};

Depth compute_depth(const RigidBody& body, const Ground& ground);

/// Largest lift of a body, metres, >= 0: an upper bound of its penetration depth.
double greatest_lift(const RigidBody& body, const Ground& ground);

/// Larger of `at_least` and the penetration depth of a body in the contact surface, metres.
/// @param lift its greatest_lift(): where that is at most `at_least`, no depth is computed
double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least);

/// Whether there is no ground below or above a point.
bool is_outside(const Ground& ground, const WorldPos& point);

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

/// The offset surface that a body moves against.
struct OffsetSurface {
    int index = 0;          ///< 0 is the highest
    bool is_mesh = false;   ///< beside volumes: the body shrinks by the offset
    double stop_gap = 0.0;  ///< casts stop at this gap, metres
    double clear_distance =
        0.0;  ///< every point may move this far without coming near the surface, metres
};

/// @param from index of the surface that the cache was refreshed for
OffsetSurface make_offset_surface(const RigidBody& body, const GroundContactCache& cache, int from,
                                  int index);

/// Index of the highest offset surface that the body does not penetrate; kOffsetCount where it penetrates all.
/// @param cache refreshed for surface 0
int first_clear_offset(const RigidBody& body, const GroundContactCache& cache);

/// Conservative swept test: true only if the box around the bounding sphere's sweep along a displacement is above all
/// ground below it, so that no rotation brings the body near the ground.
bool is_swept_sphere_clear(const RigidBody& body, const Ground& ground,
                           const Eigen::Vector3d& displacement);

enum class HitSearch {
    cast_rest,       ///< the rest of the displacement is cast: the hit is where the body touches
    stop_at_proved,  ///< the end of the proved part counts as a hit, unless nothing is proved
};

struct MoveAnswer {
    bool resident = true;
    bool hit = false;
    double fraction = 1.0;  ///< of the displacement that the body has moved
};

/// Moves a body by a displacement until it reaches the stop gap of the offset surface. Most displacements are proved
/// clear, the others are cast. The only function that changes the pose of a stepped body, except the recovery of one
/// that was placed too deep.
/// @param hits how a hit is searched for if only a part of the displacement is proved clear
MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                   OffsetSurface& surface, HitSearch hits = HitSearch::cast_rest);

/// Updates the cache and moves a body against the first offset surface that it is clear of. One that is too deep does
/// not move: step_body() recovers it.
MoveAnswer move_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                     const Twist& displacement);

/// Casts a shape against the first offset surface of bodies with this tolerance. The contact is in the frame of the
/// raised shape: kFirstOffset tolerances too high.
CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance);

/// Largest speed at which overlaps are separated, m/s. Separation leaves no velocity behind.
inline constexpr double kSeparationSpeed = 0.5;

/// Number of equal substeps of a step.
double count_substeps(double dt, double max_substep);

struct SubstepAnswer {
    /// False: ground needed for the result is not resident; the pose may have changed.
    bool resident = true;
    bool touches = false;  ///< was near enough to the ground for contacts
    std::uint64_t impacts = 0;
    double simulated_time = 0.0;
    double lost_time = 0.0;
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  ///< of the ground in step_body(), N s

    void add(const SubstepAnswer& later) {
        resident = resident && later.resident;
        touches = later.touches;
        impacts += later.impacts;
        simulated_time += later.simulated_time;
        lost_time += later.lost_time;
        impulse += later.impulse;
    }
};

/// Advances a body by `duration` seconds. Its velocity already includes its acceleration over that time.
///
/// Every displacement is proved clear of an offset surface, or cast against it, so that the penetration depth is
/// bounded by construction, whatever the solver and the integrator do.
///
/// @param cache contacts of the body with this ground
SubstepAnswer step_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                        double duration);

/// Moves a body freely, conserving its angular momentum and never adding energy.
/// @param is_flying no contact was solved: the spin is that of the middle of the time
void integrate(RigidBody& body, double duration, bool is_flying);

/// Gives a body that has turned since its spin was found the spin of the same angular momentum, or less: energy is
/// never added.
/// @param rotation_before rotation at which the spin was found
void conserve_momentum(RigidBody& body, const Eigen::Matrix3d& rotation_before);

/// Scales a displacement down so that no point moves by more than `most` metres.
Twist clamp_displacement(Twist displacement, double radius, double most);

/// Takes the potential energy of the acceleration that separation has added from the kinetic energy, as far as there is
/// any.
/// @param before where the body was
void compensate_height_gain(RigidBody& body, const WorldPos& before);

/// Recovers a body that penetrates all offset surfaces: moves it along its escape translation at bounded speed, without
/// other motion. The remaining translation bounds the depth, so the depth decreases by the distance moved; a new
/// translation replaces it only where it is shorter. False: ground needed for the result is not resident.
bool recover(RigidBody& body, const Ground& ground, double duration);

/// Contacts that approach more slowly do not bounce, m/s: the speed that the acceleration gives in four substeps.
/// @param acceleration m/s^2, >= 0
double bounce_speed(double acceleration, double duration);

// A collision step of one body: its ground contacts are found once, islands are solved in substeps on these contacts
// with poses that are scratch, and the net displacement passes the gate.

/// The time of a collision step, the same for all bodies.
struct StepSpan {
    double duration = 0.0;  ///< of the collision step, seconds
    int substep_count = 1;  ///< equal substeps of it

    double substep() const { return duration / substep_count; }
};

/// A body at the start of a collision step.
struct StepStart {
    enum class Kind : std::uint8_t {
        moving,      ///< takes part
        too_deep,    ///< penetrates all offset surfaces: recovers, and has no other motion
        unresident,  ///< ground that it may meet is not resident
    };
    Kind kind = Kind::moving;
    Pose pose;
    OffsetSurface surface;  ///< the highest that the body does not penetrate
};

/// Finds the ground contacts that a body may have within the step. Bodies above all ground that they could reach have
/// none.
///
/// @param ground_before that of the collision step before, null if there was none
StepStart begin_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                               const Ground* ground_before, const StepSpan& span);

/// Moves a body from its start to its present pose along one motion against the start's offset surface. Where that is
/// proved only in part, the body stops at the proved share, and step_body() simulates it alone for the remaining time.
SubstepAnswer end_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                                 const StepStart& start, const StepSpan& span);

/// Recovers a body that is too deep for the whole step.
SubstepAnswer recover_for_step(RigidBody& body, const Ground& ground, const StepSpan& span);

}  // namespace terrane::internal
