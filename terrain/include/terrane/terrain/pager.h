// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/body_need.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>

namespace terrane {

/// A future state of a camera.
struct CameraMoment {
    double time_s = 0.0;                                 ///< on the clock of Pager::update()
    WorldPos eye_world = WorldPos::Zero();               ///< of the camera
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit length
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit length, perpendicular to forward
};

/// A camera that draws. It is identified from update to update by its index in the list.
struct CameraNeed {
    View view;                                           ///< where it is, and what it sees
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second, world axes
    /// Screen error below which no detail is needed, pixels: TerrainMesh::threshold_px of the last frame.
    double threshold_px = 1.0;
    /// The camera's future trajectory, if known: a film, a recorded track, an announced jump. Times do not decrease;
    /// two moments at the same time are a jump. States are interpolated between moments, past moments are skipped, and
    /// the camera rests after the last one. If it is empty, the pager extrapolates velocity, acceleration and turn
    /// rates, as far ahead as such predictions have recently been right. Read during update() only.
    std::span<const CameraMoment> trajectory = {};
};

/// Which chunks are loaded, and in which order.
enum class PagingPolicy {
    /// Predicts motion, and loads the chunk with the least slack (time until the need minus expected load time) first.
    /// Skips chunks that would arrive after their need has ended.
    deadline,
    /// A common method, for comparison: loads everything within a radius around each camera, nearest first. Ignores
    /// view directions, motion and trajectories.
    distance,
};

/// Settings of a Pager. Fixed once it is created, except the ceiling: Pager::set_memory_bytes().
struct PagerSettings {
    /// Hard ceiling of the bytes of resident chunks and loads in flight together. Must hold all root squares, or those
    /// of two windows if the lattice has a root window.
    std::size_t memory_bytes = std::size_t{512} << 20;
    /// Loader threads, 0 to 256. 0: update() itself loads, and the resident set is a pure function of the calls so far.
    int worker_count = 1;
    /// How far ahead motion is predicted, seconds, 0 to 3600.
    double horizon = 4.0;
    /// Ground queries use the coarsest level with at most this spacing, metres; 0: the finest level.
    double contact_spacing = 0.0;
    /// Share of the ceiling that is reserved for contact, 0 to 1. Contact may use more, at the expense of drawing.
    double contact_share = 0.125;
    PagingPolicy policy = PagingPolicy::deadline;  ///< the order of loading
    /// With PagingPolicy::distance: load radius relative to the distance at which a camera needs a chunk, 1e-6 to 1e6.
    double distance_radius = 1.0;
    /// Timeout of a load, seconds, > 0.
    double load_timeout = 30.0;
};

/// Counts since creation, except the first six and bytes_awaited, which are current values.
struct PagerStats {
    std::size_t resident_bytes = 0;   ///< of live chunks, including those that only old sets hold
    std::size_t in_flight_bytes = 0;  ///< claimed for loads; cancelled ones count until they end
    std::size_t resident_chunks = 0;  ///< in the current set, drawn and undrawn
    std::size_t late_chunks = 0;      ///< needed at the last search for needs, and absent
    std::size_t fading_chunks = 0;    ///< with a fade below 1
    /// Bodies that touch, or may lie below, ground that is not resident.
    std::size_t groundless_bodies = 0;
    std::size_t peak_bytes = 0;  ///< largest sum of resident and in-flight bytes
    std::uint64_t loaded = 0;    ///< chunks that arrived
    std::uint64_t evicted = 0;   ///< chunks that left the set
    std::uint64_t reloaded =
        0;  ///< loads begun less than `horizon` seconds after the chunk's eviction
    std::uint64_t cancelled = 0;  ///< loads taken back from the queue, or cancelled in flight
    /// Failed loads; they are retried with back-off. Pager::last_failure() has the reason.
    std::uint64_t failed = 0;
    std::uint64_t timed_out = 0;      ///< failed loads that timed out
    std::uint64_t refused_needs = 0;  ///< cameras, bodies or regions that were not finite
    std::uint64_t cut_needs = 0;      ///< searches for needs that reached their work limit
    std::uint64_t over_ceiling = 0;   ///< loads postponed because the ceiling was reached
    std::uint64_t hard_evictions =
        0;  ///< evictions in view without a fade, for roots, contact or replacements
    /// Bytes read from storage, including those of cancelled loads, excluding those of finish().
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_used = 0;  ///< part of bytes_read: for chunks that were needed later
    /// Part of bytes_read: for resident chunks that have not been needed yet, but are predicted to be.
    std::uint64_t bytes_awaited = 0;
    std::uint64_t replaced = 0;  ///< chunks swapped by replace_chunks()
    /// Calls of replace_chunks() that were postponed because the ceiling was reached.
    std::uint64_t postponed_replacements = 0;
    /// Chunks that were loaded but not inserted, because the source had changed them meanwhile.
    std::uint64_t outdated = 0;
};

/// The state of a required region.
enum class RegionState {
    loading,   ///< some of its chunks are absent or in flight
    ready,     ///< all of its chunks are resident
    failing,   ///< some loads have failed; they are retried
    released,  ///< no longer or never required: released, refused, or the pager was destroyed
};

class RequiredRegion;

/// Keeps the chunks resident that cameras draw and bodies touch, under a hard ceiling of bytes.
///
/// Needs. A camera's motion is predicted from its position, view direction, velocity and turn rates, or given by its
/// trajectory. This tells when each chunk will first be needed. A turn is extrapolated for as long as it has lasted so
/// far, or less if recent predictions were wrong. Chunks that a camera would see only if it turned are loaded as
/// speculation; their priority falls with their distance outside the view. Bodies need the ground along their predicted
/// motion.
///
/// Loads. The classes of needs, by decreasing priority, are roots, contact, drawing and speculation. In each class late
/// chunks are loaded first, in order of decreasing screen error; the others follow in order of increasing slack, which
/// is the time until the need minus the expected load time. Chunks to be drawn wait until their slack is below 0.8 s,
/// unless there would then be too many to load. A load that would finish too late for its need is not started; a load
/// whose need has ended is cancelled. Speculation uses idle slots only, evicts nothing, and stops if unused bytes would
/// exceed 14 % of the bytes read. A failed load is retried after 0.1 s, then after a delay that doubles up to 10 s.
///
/// Undrawn ground. Of chunks coarser than contact that only bodies need, the outline alone stays resident: bounds of
/// absent ground, with which Pager::ground() answers as with the chunks. Neither they nor chunks below them are drawn
/// until a camera or a required region needs them; the chunks are then loaded.
///
/// Ceiling. Bytes are claimed before a load starts. If not everything fits, the chunks needed last are evicted first:
/// the picture becomes coarser everywhere instead of incomplete in places. A share is reserved for contact.
///
/// Fades. Arrivals and evictions cause no jump in the picture. A chunk that arrives in view is invisible at first, and
/// fades in with each update(); a chunk evicted in view fades out first, while its replacement waits. The fades of one
/// update() move the picture by at most 0.25 pixels. A fade holds back at most 1.55 pixels of screen error, because
/// above that a frame misses its target anyway, and a fade would only delay the chunk. With a morph_ratio of 1.3, a
/// chunk is therefore fully visible after 27 updates at a threshold of 0.2 pixels, after 21 at 0.5, and at once at
/// 1.55. It is also visible at once if the camera's last view did not contain it, or if the eye moved by more than a
/// tenth of the distance to it. Fades advance with updates, not with time, because jumps are visible from frame to
/// frame. Contact ignores fades. Loads of roots and contact evict at once, without fades.
///
/// Root window. If the lattice has one (Lattice::root_window), only chunks in it are resident. It follows the first
/// camera; without cameras the first body, else the first required region. When this client leaves the middle two by
/// two root squares, the window moves by as few root squares as necessary: as soon as the root squares of its new
/// position are loaded, or at once if the client has left the window. Beyond the window nothing is resident: bodies
/// have no ground there, and regions are not ready. Root squares in the window are requested by the first update() and
/// never evicted.
///
/// Threads: one thread calls update(), require() and finish(); any thread may hold and read the sets of resident().
class Pager {
public:
    /// Fails: invalid_argument for settings out of their ranges; out_of_memory if the ceiling does not hold
    ///        the root squares
    static Result<Pager> create(std::shared_ptr<const HeightSource> source,
                                const PagerSettings& settings);
    /// As above, with the caller's loader instead of threads; ignores settings.worker_count and load_timeout.
    static Result<Pager> create(std::shared_ptr<const HeightSource> source,
                                const PagerSettings& settings, std::unique_ptr<ChunkLoader> loader);

    Pager(Pager&&) noexcept;
    Pager& operator=(Pager&&) noexcept;
    /// Stops the loader. Waits for loads in flight, but not for hanging storage: see chunk_loader.h.
    ~Pager();

    /// Inserts arrived chunks, requests the chunks that are needed next, and evicts others. With worker_count > 0 it
    /// never waits for a load. Searches for needs twenty times a second of the caller's clock, and at once when a
    /// camera jumps or the number of cameras, bodies or required regions changes.
    ///
    /// @param time_s the current time, seconds, on any clock that does not go back
    void update(std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
                double time_s);
    /// As above, for a list of cameras: `pager.update({camera}, world.needs(), time_s)`.
    void update(std::initializer_list<CameraNeed> cameras, std::span<const BodyNeed> bodies,
                double time_s) {
        update(std::span(cameras.begin(), cameras.size()), bodies, time_s);
    }

    /// Requests all ground of a rectangle at contact level, for example before a teleport, and keeps it resident while
    /// the returned object lives. Its loads have the priority of contact; among them, earlier deadlines come first. A
    /// region that is not finite, or a deadline that is NaN, is refused and counted. The ground can also be drawn.
    [[nodiscard]] RequiredRegion require(const WorldRect& region, double deadline_s);

    /// Loads until all needs of the last update() are resident, or the ceiling or a failing source prevents it.
    /// Completes all fades. Blocks: not for use in a frame.
    void finish();

    /// Changes PagerSettings::memory_bytes. If more is resident, the next update() evicts what does not fit, without
    /// fades: what is needed last first, ground below bodies last. Until loads in flight have ended and callers have
    /// released older sets, the bytes of both may exceed a lowered ceiling, and no load starts.
    ///
    /// Fails: out_of_memory if the ceiling does not hold the root squares; it is kept then
    Result<void> set_memory_bytes(std::size_t memory_bytes);

    /// The resident chunks. Never null; changes only in update() and finish().
    std::shared_ptr<const ResidentSet> resident() const;

    /// The level at which ground queries are answered.
    int contact_level() const;
    /// The contact surface of the resident chunks: a snapshot, to be taken after each update().
    ///
    /// @param surface_map friction, restitution and material by place; null: none
    Ground ground(std::shared_ptr<const SurfaceMap> surface_map = nullptr) const;
    /// The statistics so far.
    PagerStats stats() const;
    /// The message of the last failed load, one sentence; empty if none has failed.
    std::string last_failure() const;

private:
    friend class RequiredRegion;
    friend bool replace_chunks(Pager& pager, const ChunkReplacement& replacement);
    struct State;
    explicit Pager(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;  // the only owner; required regions hold weak pointers
};

/// A region whose ground a pager keeps resident while this object lives: see Pager::require(). May outlive the pager.
///
/// Threads: the pager's
class RequiredRegion {
public:
    /// A region that keeps nothing resident.
    RequiredRegion() = default;
    RequiredRegion(RequiredRegion&& other) noexcept;
    RequiredRegion& operator=(RequiredRegion&& other) noexcept;
    ~RequiredRegion();

    /// The state of the requirement. Cost: O(chunks over the region)
    RegionState state() const;
    /// Whether all of its ground is resident.
    bool is_ready() const { return state() == RegionState::ready; }
    /// Ends the requirement; its ground may be evicted from then on.
    void release();

private:
    friend class Pager;
    RequiredRegion(const std::shared_ptr<Pager::State>& pager, std::uint64_t id)
        : pager_(pager), id_(id) {}

    std::weak_ptr<Pager::State> pager_;
    std::uint64_t id_ = 0;
};

}  // namespace terrane
