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
    WorldPos eye_world = WorldPos::Zero();               ///< where it will be
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit length
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit length, square to forward
};

/// A camera that draws. It is identified from update to update by its index in the list.
struct CameraNeed {
    View view;                                           ///< where it is, and what it sees
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second, world axes
    /// Screen error below which no detail is needed, pixels: TerrainMesh::threshold_px of the last frame.
    double threshold_px = 1.0;
    /// Its future trajectory, if known: a film, a recorded track, an announced jump. Times do not decrease;
    /// two moments of equal time are a jump. Between moments states are interpolated; past ones are skipped;
    /// after the last one the camera is at rest. Empty: the pager extrapolates velocity, acceleration and
    /// turn rates as far as they can be trusted. Read during update() only.
    std::span<const CameraMoment> trajectory = {};
};

/// Which chunks are loaded, in which order.
enum class PagingPolicy {
    /// Predicts motion; the least slack (time until the need minus expected load time) is loaded first,
    /// while it can still arrive before the need ends.
    deadline,
    /// The usual method, for comparison: everything within a radius around each camera, whatever its
    /// direction and motion, nearest first; only given trajectories of bodies are followed.
    distance,
};

/// Settings of a Pager. Fixed once it is created.
struct PagerSettings {
    /// Hard ceiling of the bytes of resident chunks and loads in flight together; must hold the root squares, of a
    /// lattice with a root window twice those of the window.
    std::size_t memory_bytes = std::size_t{512} << 20;
    /// Loader threads, 0 to 256; 0 loads inside update(), so that the resident set is a pure function of
    /// the calls so far.
    int worker_count = 1;
    /// How far ahead motion is predicted, seconds, 0 to 3600.
    double horizon = 4.0;
    /// Ground queries answer at the coarsest level with at most this spacing, metres; 0: the finest.
    double contact_spacing = 0.0;
    /// Share of the ceiling that is reserved for contact, 0 to 1. Contact may take more, from drawing.
    double contact_share = 0.125;
    PagingPolicy policy = PagingPolicy::deadline;  ///< the order of loading
    /// With PagingPolicy::distance: load radius over the distance at which a camera needs a chunk, 1e-6 to 1e6.
    double distance_radius = 1.0;
    /// Timeout of a load, seconds, > 0.
    double load_timeout = 30.0;
};

/// Counts since creation, except the first six and bytes_awaited, which are present values.
struct PagerStats {
    std::size_t resident_bytes = 0;   ///< of live chunks, including those that only old sets hold
    std::size_t in_flight_bytes = 0;  ///< claimed for loads; cancelled ones count until they end
    std::size_t resident_chunks = 0;  ///< in the present set
    std::size_t late_chunks = 0;      ///< needed at the last update(), and absent
    std::size_t fading_chunks = 0;    ///< with a fade below 1
    /// Bodies that touch, or may lie below, ground that is not resident.
    std::size_t groundless_bodies = 0;
    std::size_t peak_bytes = 0;   ///< largest sum of resident and in flight
    std::uint64_t loaded = 0;     ///< chunks that arrived
    std::uint64_t evicted = 0;    ///< chunks that left the set
    std::uint64_t reloaded = 0;   ///< loads begun less than a horizon after the chunk's eviction
    std::uint64_t cancelled = 0;  ///< loads taken back from the queue, or cancelled in flight
    /// Failed loads; retried with back-off. Pager::last_failure() has the reason.
    std::uint64_t failed = 0;
    std::uint64_t timed_out = 0;      ///< failed loads that timed out
    std::uint64_t refused_needs = 0;  ///< cameras, bodies or regions that were not finite
    std::uint64_t cut_needs = 0;      ///< plans whose bodies and regions exceeded the work limit
    std::uint64_t over_ceiling = 0;   ///< loads postponed because the ceiling was reached
    std::uint64_t hard_evictions =
        0;  ///< evictions in view without a fade, for urgent contact or roots
    /// From storage, including cancelled loads, excluding those of finish().
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_used = 0;  ///< part of bytes_read: of chunks that were needed then
    /// Part of bytes_read: of resident chunks not needed yet, but predicted to be.
    std::uint64_t bytes_awaited = 0;
    std::uint64_t replaced = 0;  ///< chunks swapped by replace_chunks()
    /// Calls of replace_chunks() that were postponed because the ceiling was reached.
    std::uint64_t postponed_replacements = 0;
    std::uint64_t outdated = 0;  ///< loads whose chunk the source had changed meanwhile
};

/// The state of a required region.
enum class RegionState {
    loading,   ///< some of it is absent or in flight
    ready,     ///< all of it is resident
    failing,   ///< some loads have failed; they are retried
    released,  ///< not required (any more), refused, or the pager is gone
};

class RequiredRegion;

/// Keeps the chunks resident that cameras draw and bodies touch, under a hard ceiling of bytes.
///
/// Needs. The motion of a camera is predicted from its position, view direction, velocity and turn rates, or given
/// by its trajectory; so each chunk has a time at which it is needed first. A turn is extrapolated for as long as it
/// has lasted so far, and less after recent wrong predictions; what a camera may turn to is speculation, of lower
/// priority the farther outside the view it lies. Bodies need the ground along their predicted motion.
///
/// Loads. Priority: roots, contact, drawing, speculation; within a class late needs first, by the error that they
/// leave, then the others by slack: the time until the need minus the expected load time. Chunks to be drawn are
/// loaded up to a second ahead, earlier only if there would be too much to load then. A load that cannot arrive
/// before its need ends is not begun, and one whose need has ended is cancelled. Speculation uses idle slots,
/// evicts nothing, and its unused reads are at most a seventh of all bytes. Failed loads are retried after 0.1 s,
/// then after twice as long each time, up to 10 s.
///
/// Ceiling. Bytes are claimed before a load begins. Where not everything fits, the chunks needed last are evicted
/// first, and the picture is coarser everywhere rather than missing somewhere. A share is reserved for contact.
///
/// Fades. Chunks appear and vanish without a jump in the picture: a chunk that a camera would see appear starts with
/// a fade at which it is invisible and fades in with each update(); one that it would see vanish fades out first,
/// while its replacement waits. That moves the picture by at most 0.25 pixels in one update(). At most 1.55 pixels of
/// screen error are held back: with more error than that a frame misses its target anyway, and a fade would only
/// delay the chunk. So a chunk is fully visible after 27 updates at a threshold of 0.2 pixels, after 21 at 0.5, and
/// at once at 1.55 (with a morph_ratio of 1.3). It appears at once, too, if a camera's last view did not contain it,
/// or if the eye moved by more than a tenth of the distance to it. Fades advance with updates, not with time: an
/// update is a frame, and jumps are visible between frames. Ground does not fade. Loads of roots and contact evict at
/// once, without fades.
///
/// Root window. Of a lattice with a Lattice::root_window only root squares in the window are resident. It lies around
/// the first camera; without cameras around the first body, else around the first required region. When that is not in
/// one of the middle two root squares any more, the window moves by as few of them as necessary, as soon as those of
/// its new place are loaded; at once where the client is outside of it. Beyond the window nothing is resident: bodies
/// there are without ground, and regions there are not ready.
///
/// Threads: one calls update(), require() and finish(); any may hold and read the sets of resident(). Root squares are
/// never evicted while they are in the window: the first update() requests them.
class Pager {
public:
    /// Fails: invalid_argument for settings out of their ranges; out_of_memory if the ceiling does not hold
    ///        the root squares
    static Result<Pager> create(std::shared_ptr<const HeightSource> source,
                                const PagerSettings& settings);
    /// The same with a loader of the caller's instead of threads; settings.worker_count and load_timeout are
    /// ignored.
    static Result<Pager> create(std::shared_ptr<const HeightSource> source,
                                const PagerSettings& settings, std::unique_ptr<ChunkLoader> loader);

    Pager(Pager&&) noexcept;
    Pager& operator=(Pager&&) noexcept;
    /// Stops the loader; waits for loads in flight, but not for storage that hangs: see chunk_loader.h.
    ~Pager();

    /// Inserts arrived chunks, requests what is needed next, evicts. With workers it never waits for a load.
    /// Needs are found twenty times a second of the clock, and at once when a camera jumps or the number of
    /// cameras, bodies or required regions changes.
    ///
    /// @param time_s the present, seconds, on any clock that does not go back
    void update(std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
                double time_s);
    /// The same with a list of cameras: `pager.update({camera}, world.needs(), time_s)`.
    void update(std::initializer_list<CameraNeed> cameras, std::span<const BodyNeed> bodies,
                double time_s) {
        update(std::span(cameras.begin(), cameras.size()), bodies, time_s);
    }

    /// Requests all ground of a rectangle at contact level, as before a teleport, and keeps it resident while the
    /// returned object lives. Contact has priority over drawing, the earliest deadline first. A region or deadline that
    /// is not finite is refused and counted.
    [[nodiscard]] RequiredRegion require(const WorldRect& region, double deadline_s);

    /// Loads until all needs of the last update() are resident, or the ceiling or a failing source prevents
    /// it, and completes all fades. Blocks: not for use in a frame.
    void finish();

    /// The resident chunks. Never null; changes only in update() and finish().
    std::shared_ptr<const ResidentSet> resident() const;

    /// The level that ground queries answer at.
    int contact_level() const;
    /// The contact surface of the resident chunks: a snapshot, to be taken after each update().
    ///
    /// @param surface_map friction, restitution and material by place; null: none
    Ground ground(std::shared_ptr<const SurfaceMap> surface_map = nullptr) const;
    /// Counts, and what is resident at present.
    PagerStats stats() const;
    /// The message of the last failed load, one sentence; empty if none has failed.
    std::string last_failure() const;

private:
    friend class RequiredRegion;
    friend bool replace_chunks(Pager& pager, const ChunkReplacement& replacement);
    struct State;
    explicit Pager(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;  // owned here alone; required regions observe it
};

/// A region whose ground a pager keeps resident while this object lives: see Pager::require(). May outlive the pager.
///
/// Threads: the pager's
class RequiredRegion {
public:
    /// Requires nothing.
    RequiredRegion() = default;
    RequiredRegion(RequiredRegion&& other) noexcept;
    RequiredRegion& operator=(RequiredRegion&& other) noexcept;
    ~RequiredRegion();

    /// What has become of the requirement. Cost: O(chunks over the region)
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
