// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/contact_solver.h"
#include "world/solver/rigid_body.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Offset surfaces: the contact surface lowered by shares of the body's tolerance, from a quarter to almost all, in
/// decreasing steps. A body stopped at one starts clear of the next lower one, so that it can always move away.
inline constexpr double kFirstOffset = 0.25;
inline constexpr int kOffsetCount = 48;
/// Largest gap at which a cast stops above its offset surface, in tolerances. It is much smaller than the step between
/// two surfaces, so that a stopped body is clear of the next one on slopes up to 86 degrees.
inline constexpr double kStopGap = 1.0 / 256.0;
/// Least stop gap, metres, slightly above rounding, so that a body closer than kStopGap may move away.
inline constexpr double kLeastStopGap = 1e-11;
/// Gap at which bodies rest above the first offset surface, in tolerances. At this gap a body is on the contact surface
/// itself, so that a body placed there stays. The gap exceeds every stop gap, so that the body can slide.
inline constexpr double kRestGap = kFirstOffset;
/// Gap to which separation lifts a body above the offset surface, in tolerances. A body placed on a slope of up
/// to 60 degrees has at least this gap, so separation does not move it.
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
    double distance = 0.0;  ///< lower bound of the shrunk body's distance from triangles, metres

    /// Gap to the volumes at which a cast stops a body whose distance is `distance`, metres.
    double stop_gap(double tolerance) const {
        return std::max(kLeastStopGap, 0.5 * std::min(distance, 2.0 * kStopGap * tolerance));
    }
};

/// Finds the first offset from `from` on at which a body near volumes is clear by the stop gap; at the last offset any
/// distance above 0 suffices.
MeshOffset find_mesh_offset(const RigidBody& body, const Ground& ground, int from);

/// The offset surface against which a body moves.
struct OffsetSurface {
    int index = 0;                ///< 0 is the highest
    bool is_mesh = false;         ///< near volumes: the body shrinks by the offset
    double stop_gap = 0.0;        ///< casts stop at this gap, metres
    double clear_distance = 0.0;  ///< no point reaches the surface within this distance, metres
};

/// The cells that a body widened by a margin, metres, may overlap.
CellRange cells_around(const RigidBody& body, const Ground& ground, double margin);

/// Cached contacts of one body with an offset surface. Reused while the body has moved less than the reuse distance:
/// each contact keeps its plane, and only its gap is updated.
class GroundContactCache {
public:
    static constexpr std::size_t kMaxCount = 64;

    /// Parameters of a search for contacts.
    struct Search {
        int offset_index = 0;  ///< of the surface
        /// Search distance beyond the contact margin, metres: how far the body may move until the next refresh.
        double reach = 0.0;
        /// Additional distance at which volumes count as near, metres.
        double travel = 0.0;
        bool is_clear = false;  ///< known not to penetrate the surface: the lift is not computed
    };
    /// Finds the contacts at the body's pose.
    void refresh(const RigidBody& body, const Ground& ground, const Search& search);

    /// Updates the gaps if the cached contacts are still valid, else finds contacts for the first offset surface.
    /// @param travel distance that the body may move until the next refresh, metres
    void update(const RigidBody& body, const Ground& ground, double travel = 0.0);

    /// Updates the gaps for a body that has moved since the refresh: each contact keeps its plane.
    void follow(const RigidBody& body);

    /// Empties the cache of a body that cannot come near the ground until the next update.
    void set_out_of_reach();

    /// Makes the next update() find contacts anew; required if the ground may have changed.
    void invalidate() { is_reusable_ = false; }
    /// Invalidates the contacts at the start of a step, and saves them for undo_step().
    void begin_step() {
        invalidate();
        step_start_contacts_ = contacts_;
    }
    void undo_step() {
        invalidate();
        contacts_ = step_start_contacts_;
    }
    /// Resets the cache to the state of a new one, but keeps its memory.
    void reset();

    bool is_resident() const { return resident_; }
    bool is_out_of_reach() const { return is_out_of_reach_; }
    bool has_contacts() const { return !contacts_.empty(); }
    std::size_t count() const { return contacts_.size(); }
    /// Whether the last refresh found the same contacts and normals as the previous one.
    bool has_same_contacts() const { return is_same_; }
    /// Whether the smallest gap is within the contact margin.
    bool is_near(const RigidBody& body) const;
    /// Upper bound of the lift over the refreshed offset surface, metres.
    double lift() const { return lift_ + moved_; }
    /// Smallest gap of the contacts to a surface lower by `extra_offset`, at most `limit`, metres.
    double least_gap(double extra_offset, double limit) const;
    /// Distance that every point of the body may move while staying clear of an offset surface that is lower by
    /// `extra_offset`, metres: at most half of the smallest gap. <= 0 if unknown.
    double clear_distance(double extra_offset) const;

    /// The highest offset surface that the body does not penetrate, if any. Requires a refresh for surface 0.
    std::optional<OffsetSurface> highest_clear_surface(const RigidBody& body) const;
    /// Offset surface `index`, at or below the refreshed one. Near volumes, the first surface at or below it that the
    /// body does not penetrate.
    OffsetSurface surface(const RigidBody& body, int index) const;

    /// Gap of contact i, metres.
    double gap(std::size_t i) const { return contacts_[i].gap; }
    /// Contact i for the solver.
    /// @param index the body's index in the solver
    SolverContact contact(std::size_t i, const RigidBody& body, std::uint32_t index) const;
    void set_impulse(std::size_t i, const Eigen::Vector3d& impulse) {
        contacts_[i].impulse = impulse;
    }

    /// Serialises the fields of the previous contacts that refresh() reads. A copy made between two steps needs no
    /// others. See world/world_bytes.h.
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
    ContactAnswer find_on_mesh(const RigidBody& body, const Ground& ground,
                               std::span<Contact> contacts_out, std::span<double> openings_out);
    const CachedContact* find_previous(const CachedContact& contact) const;

    std::vector<CachedContact> contacts_, previous_contacts_, step_start_contacts_;
    int offset_index_ = 0;  // of the refresh
    Pose refresh_pose_;
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

}  // namespace terrane::internal
