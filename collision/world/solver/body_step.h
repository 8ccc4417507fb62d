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

/// The penetration depth of a body in the contact surface, or `at_least` if that is larger, metres.
/// @param lift its greatest_lift(); if at most `at_least`, no depth is computed
double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least);

/// Whether there is no ground below or above a point.
bool is_outside(const Ground& ground, const WorldPos& point);

/// Offset surfaces: the contact surface lowered by a share of the body's tolerance, from a quarter of it to almost all
/// of it in decreasing steps. A body stopped at one surface starts clear of the next, so that it can always move away.
inline constexpr double kFirstOffset = 0.25;
inline constexpr int kOffsetCount = 48;
/// Largest gap at which a cast stops above its offset surface, in tolerances. Much smaller than the step between two
/// surfaces, so that a stopped body is clear of the next one on slopes up to 86 degrees.
inline constexpr double kStopGap = 1.0 / 256.0;
/// Gap at which bodies rest above the first offset surface, in tolerances. This is the contact surface itself, so that
/// a body placed on it stays, and it is above every stop gap, so that the body can slide.
inline constexpr double kRestGap = kFirstOffset;
/// Gap that separation restores, in tolerances: below that of a body placed on a 60 degree slope.
inline constexpr double kSeparationGap = 0.5 * kRestGap;
/// Contacts are searched up to this gap above the offset surface, in tolerances.
inline constexpr double kContactMargin = 1.0 / 2.0;

/// Depth of an offset surface below the contact surface, metres.
double offset_depth(const RigidBody& body, int index);
/// A pose moved up: querying a raised shape is equivalent to lowering the surface.
Pose raised(Pose pose, double height);

/// Offset near volumes: instead of lowering the surface, the body is shrunk, so that offsets also hold for ceilings and
/// walls.
struct MeshOffset {
    bool is_missing = false;  ///< ground that is not resident may be near
    int index = 0;          ///< first offset at which the shrunk body is clear; kOffsetCount: none
    double distance = 0.0;  ///< lower bound of its distance from all triangles, metres
};

/// Finds the first offset from `from` on at which a body near volumes is clear by the stop gap, if any.
MeshOffset find_mesh_offset(const RigidBody& body, const Ground& ground, int from);

/// Cached contacts of one body with an offset surface. Reused while the body has moved less than the reuse distance:
/// each contact keeps its plane, and only its gap is updated.
class GroundContactCache {
public:
    static constexpr std::size_t kMaxCount = 64;

    /// Updates the gaps if the cached contacts are still valid, else finds contacts for the first offset surface.
    /// @param travel distance that the body may move until the next refresh, metres: triangles of volumes within it are
    ///               included
    void update(const RigidBody& body, const Ground& ground, double travel = 0.0);

    /// Finds the contacts at the body's pose.
    /// @param reach extends the search beyond the contact margin, metres: distance that the body may move until the
    ///              next refresh
    void refresh(const RigidBody& body, const Ground& ground, int offset_index,
                 double reach = 0.0) {
        find(body, ground, offset_index, reach, 0.0, false);
    }
    /// As refresh() for the first offset surface, at the start of a collision step. Skips the penetration test if the
    /// end of the previous step proved the body clear of that surface.
    /// @param ground_before ground of the previous step, or null
    /// @param travel        as for update()
    void refresh_for_step(const RigidBody& body, const Ground& ground, const Ground* ground_before,
                          double reach, double travel);

    /// Records, until the next collision step, that the body at its current pose was proved clear of the first offset
    /// surface.
    void set_proved_clear(const RigidBody& body) { clear_pose_ = body.pose; }
    void forget_proof() { clear_pose_.reset(); }

    /// Updates the gaps for a body that has moved since the refresh: each contact keeps its plane.
    void follow(const RigidBody& body);

    /// Empties the cache of a body that cannot come near the ground until the next update.
    void set_out_of_reach();

    /// Resets to a new cache, keeping its memory.
    void reset();

    /// Makes the next update() find contacts anew; required if the ground may have changed.
    void invalidate() { is_reusable_ = false; }
    /// Invalidates at the start of a step, and saves the impulses for undo_step().
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
    /// Whether the last refresh found the same contacts and normals as the previous one.
    bool has_same_contacts() const { return is_same_; }
    /// Upper bound of the lift over the refreshed offset surface, metres.
    double lift() const { return lift_ + moved_; }
    /// Distance that every point of the body may move while staying clear of an offset surface that is lower by
    /// `extra_offset`, metres: at most half of the smallest gap. <= 0 if unknown.
    double clear_distance(double extra_offset) const;

    /// Whether the last refresh was near volumes, against triangles.
    bool is_on_mesh() const { return is_on_mesh_; }
    /// If is_on_mesh(): the first offset, from that of the refresh on, at which the shrunk body is clear; kOffsetCount
    /// if none.
    int mesh_offset() const { return mesh_offset_.index; }
    /// If is_on_mesh(): a lower bound of the shrunk body's distance from all triangles, metres.
    double mesh_distance() const { return mesh_offset_.distance - moved_; }

    /// Smallest gap of the contacts to a surface lower by `extra_offset`, at most `limit`, metres.
    double least_gap(double extra_offset, double limit) const;

    /// Gap of contact i, metres.
    double gap(std::size_t i) const { return contacts_[i].gap; }

    /// Contact i for the solver.
    /// @param index the body's index in the solver
    SolverContact contact(std::size_t i, const RigidBody& body, std::uint32_t index) const;

    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        contacts_[i].impulse = impulse;
    }

    /// Serialises the fields that a copy needs between two steps: those of the previous contacts that refresh() reads.
    /// See world/world_bytes.h.
    /// @param cache a GroundContactCache, const for writing
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
    /// The core point of a contact is its point on the shape, moved inward by the radius of a sphere or capsule.
    struct CachedContact {
        ShapeFeature feature;
        std::uint32_t part;         // of a compound
        Eigen::Vector3d impulse;    // of the last substep, N s
        Eigen::Vector3d core_body;  // core point, body frame
        Eigen::Vector3d normal;
        double gap;                    // now
        double refresh_gap;            // at the last refresh
        Eigen::Vector3d refresh_core;  // core point at the last refresh, world
        double opening;                // growth of the gap per metre of offset
        double rounding;
        double friction, restitution;  // combined with the ground's surface
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
    double moved_ = 0.0;   // upper bound of any point's displacement since the refresh
    double margin_ = 0.0;  // gap up to which the refresh searched, metres
    bool resident_ = true;
    bool is_reusable_ = false;
    bool is_same_ = false;
    bool is_out_of_reach_ = false;
    bool is_on_mesh_ = false;
    MeshOffset mesh_offset_;
    bool is_exhaustive_ =
        false;  // all contacts are cached, and all cells around the body are ground
};

/// The offset surface against which a body moves.
struct OffsetSurface {
    int index = 0;                ///< 0 is the highest
    bool is_mesh = false;         ///< near volumes: the body shrinks by the offset
    double stop_gap = 0.0;        ///< casts stop at this gap, metres
    double clear_distance = 0.0;  ///< distance every point may move clear of the surface, metres
};

/// @param from index of the surface for which the cache was refreshed
OffsetSurface make_offset_surface(const RigidBody& body, const GroundContactCache& cache, int from,
                                  int index);

/// Index of the highest offset surface that the body does not penetrate; kOffsetCount if it penetrates all.
/// @param cache refreshed for surface 0
int first_clear_offset(const RigidBody& body, const GroundContactCache& cache);

/// Conservative swept test: true only if the box around the bounding sphere's sweep is above all ground below it, so
/// that the body stays clear whatever its rotation.
bool is_swept_sphere_clear(const RigidBody& body, const Ground& ground,
                           const Eigen::Vector3d& displacement);

enum class HitSearch {
    cast_rest,       ///< casts the remaining displacement: the hit is at first touch
    stop_at_proved,  ///< reports a hit at the end of the proved part, unless nothing is proved
};

struct MoveAnswer {
    bool resident = true;
    bool hit = false;
    double fraction = 1.0;  ///< share of the displacement made
};

/// Moves a body by a displacement, or until it reaches the stop gap of the offset surface. Most displacements are
/// proved clear; the others are cast. Apart from the recovery of bodies placed too deep, this is the only function that
/// changes the final pose of a stepped body.
/// @param hits how to find a hit if only part of the displacement is proved clear
MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                   OffsetSurface& surface, HitSearch hits = HitSearch::cast_rest);

/// Updates the cache and moves a body against the first offset surface that it is clear of. A body that is too deep
/// does not move: step_body() recovers it.
MoveAnswer move_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                     const Twist& displacement);

/// Casts a shape against the first offset surface for a tolerance. The contact is that of the raised shape,
/// kFirstOffset tolerances too high.
CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance);

/// Largest speed of separation of overlaps, m/s. Separation changes no velocity.
inline constexpr double kSeparationSpeed = 0.5;

/// Number of equal substeps of a step.
double count_substeps(double dt, double max_substep);

struct SubstepAnswer {
    /// False: ground needed for the result is not resident; the pose may have changed.
    bool resident = true;
    bool touches = false;  ///< near enough to the ground for contacts
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

/// Advances a body by `duration` seconds. Its velocity already includes the acceleration over that time.
///
/// Every displacement is proved clear of an offset surface or cast against it, so that the penetration depth is bounded
/// by construction, independent of solver and integrator.
///
/// @param cache contacts of the body with this ground
SubstepAnswer step_body(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                        double duration);

/// Moves a body freely, conserving its angular momentum and never adding energy.
/// @param is_flying no contact was solved: uses the spin at the middle of the interval
void integrate(RigidBody& body, double duration, bool is_flying);

/// Updates the spin of a rotated body to conserve its angular momentum; scales it down if that would add energy.
/// @param rotation_before rotation for which the spin was computed
void conserve_momentum(RigidBody& body, const Eigen::Matrix3d& rotation_before);

/// Scales a displacement so that no point moves by more than `most` metres.
Twist clamp_displacement(Twist displacement, double radius, double most);

/// Removes the potential energy gained by separation from the kinetic energy, down to zero.
/// @param before position before the separation
void compensate_height_gain(RigidBody& body, const WorldPos& before);

/// Recovers a body that penetrates all offset surfaces: moves it only along its escape translation, at bounded speed.
/// The remaining translation bounds the depth, so the depth decreases by the distance moved; only a shorter translation
/// replaces it. False: ground needed for the result is not resident.
bool recover(RigidBody& body, const Ground& ground, double duration);

/// Approach speed below which contacts do not bounce, m/s: at least the speed gained by the acceleration in four
/// substeps.
/// @param acceleration m/s^2, >= 0
double bounce_speed(double acceleration, double duration);

// Collision step of one body: finds its ground contacts once; islands are solved in substeps on these contacts with
// scratch poses; finally the net displacement is proved or cast against an offset surface.

/// Duration and substeps of a collision step, the same for all bodies.
struct StepSpan {
    double duration = 0.0;  ///< of the collision step, seconds
    int substep_count = 1;  ///< equal substeps of it

    double substep() const { return duration / substep_count; }
};

/// A body at the start of a collision step.
struct StepStart {
    enum class Kind : std::uint8_t {
        moving,      ///< takes part in the step
        too_deep,    ///< penetrates all offset surfaces: only recovers
        unresident,  ///< ground that it may touch is not resident
    };
    Kind kind = Kind::moving;
    Pose pose;
    OffsetSurface surface;  ///< the highest surface that the body does not penetrate
};

/// Finds the ground contacts that a body may have within the step. Bodies above all reachable ground have none.
///
/// @param ground_before ground of the previous collision step, or null
StepStart begin_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                               const Ground* ground_before, const StepSpan& span);

/// Moves a body from its start to its current pose along one motion, against the start's offset surface. If only part
/// of it is proved clear, the body stops there, and step_body() simulates it alone for the remaining time.
SubstepAnswer end_collision_step(RigidBody& body, GroundContactCache& cache, const Ground& ground,
                                 const StepStart& start, const StepSpan& span);

/// Recovers a body that is too deep, over the whole step.
SubstepAnswer recover_for_step(RigidBody& body, const Ground& ground, const StepSpan& span);

}  // namespace terrane::internal
