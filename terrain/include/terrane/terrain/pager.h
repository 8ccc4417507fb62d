// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/body_need.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace terrane {

/// Where a camera will be, and how it will look.
struct CameraMoment {
    double time_s = 0.0;  ///< on the clock of Pager::update()
    WorldPos eye_world = WorldPos::Zero();
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit length
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit length, square to forward
};

/// A camera that draws. From update to update it is known by its place in the list.
struct CameraNeed {
    View view;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second, world axes
    /// Detail below this many pixels is of no use: TerrainMesh::threshold_px of the last frame.
    double threshold_px = 1.0;
    /// Where it will be, where its owner knows: a film, a recorded track, a jump that is announced.
    /// Times do not fall; two moments of one time are a jump, with nothing between them. Moments that
    /// have passed are passed over; behind the last one the camera stands. Empty: the pager follows
    /// velocity, acceleration and turning as far as they can be trusted. Read during update() only.
    std::span<const CameraMoment> trajectory = {};
};

/// In which order chunks are loaded, and what is loaded at all.
enum class PagingPolicy {
    /// Motion is followed ahead; what is needed first, less the time that its loading takes, goes
    /// first, while it can still arrive in time to be of use.
    deadline,
    /// What most pagers do, for comparison: everything within a radius around each camera, whichever
    /// way it looks or moves, the nearest first; nothing is foreseen but known ways of bodies.
    distance,
};

struct PagerSettings {
    /// Hard ceiling of resident bytes and loads in flight together; at least the roots fit.
    std::size_t memory_bytes = std::size_t{512} << 20;
    /// Loader threads; 0 loads inside update(), so that the resident set is a pure function of what
    /// was asked so far.
    int worker_count = 1;
    /// How far ahead motion is followed, seconds, >= 0.
    double horizon = 4.0;
    /// Ground queries answer at the coarsest level with at most this spacing, metres; 0: the finest.
    double contact_spacing = 0.0;
    /// Share of the ceiling that is kept free for contact, 0 to 1. Contact may take more, from what
    /// is drawn.
    double contact_share = 0.125;
    PagingPolicy policy = PagingPolicy::deadline;
    /// With PagingPolicy::distance: how many times as far as a camera needs a chunk it is loaded, > 0.
    double distance_radius = 1.0;
    /// A load that the storage has not answered for so long is given up, seconds, > 0.
    double load_timeout = 30.0;
};

/// Counts since creation, but for the first six and bytes_awaited.
struct PagerStats {
    std::size_t resident_bytes = 0;  ///< of live chunks, those that only old sets hold included
    std::size_t in_flight_bytes =
        0;  ///< claimed for loads; given-up ones count whole until they end
    std::size_t resident_chunks = 0;
    std::size_t late_chunks = 0;    ///< needed at the last update(), and not there
    std::size_t fading_chunks = 0;  ///< with a fade below 1
    /// Whose ground is not all resident: bodies that touch a chunk's ground, or may lie below it.
    std::size_t groundless_bodies = 0;
    std::size_t peak_bytes = 0;  ///< resident and in flight together
    std::uint64_t loaded = 0;
    std::uint64_t evicted = 0;
    std::uint64_t reloaded = 0;   ///< begun less than a horizon after they were evicted
    std::uint64_t cancelled = 0;  ///< taken back from the queue, or given up in flight
    /// Loads that brought nothing; retried with back-off. Pager::last_failure() says why.
    std::uint64_t failed = 0;
    std::uint64_t timed_out = 0;      ///< ... of these, because the storage did not answer
    std::uint64_t refused_needs = 0;  ///< cameras or bodies that were not finite
    std::uint64_t cut_needs = 0;  ///< times when bodies and regions asked for too much to look at
    std::uint64_t over_ceiling = 0;    ///< loads put off because the ceiling was reached
    std::uint64_t hard_evictions = 0;  ///< of chunks in view, for ground that could not wait
    /// From storage, for loads that were given up too, but for what finish() waited for.
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_used = 0;  ///< ... of these, for chunks that somebody then needed
    /// ... of these, for resident chunks that nobody has needed yet, but somebody is foreseen to.
    std::uint64_t bytes_awaited = 0;
};

/// How far a required region is.
enum class TicketState {
    loading,
    ready,    ///< all of it is resident
    failing,  ///< some of it could not be loaded so far; it is tried again
    unknown,  ///< released, or the region was refused
};

/// Keeps resident what cameras draw and bodies touch, under a hard ceiling of bytes.
///
/// Needs. Where a camera will be follows from its place, look, speed and turning, or from its way where
/// that is known; so each chunk has a time when it is needed first. What lies ahead in a turn is trusted
/// for as long as the turn has lasted, and less where such guesses went wrong lately; what a camera may
/// turn to is speculation, and counts the less the further beside the view it lies. Bodies ask for the
/// ground on their way.
///
/// Loads. Contact goes before what is drawn, that before speculation; within each, what is late first,
/// by the error that it removes, then what has the least time left, less what loads of its kind have
/// taken. What is drawn is loaded up to a second ahead, earlier only where there would be too much to
/// load then. What cannot arrive before it is passed is not begun, and what nobody needs any more is
/// given up. Speculation takes what is left: no memory that something else has, and a seventh of what is
/// read at most. What fails is tried again after a tenth of a second, then after twice as long each
/// time, up to ten.
///
/// Ceiling. Bytes are claimed before a load begins. Where not everything fits, what is needed last goes
/// first, and what is drawn is coarser everywhere rather than absent somewhere. Contact keeps a share.
///
/// Chunks come and go without a jump in the picture: what a camera would see appear begins with a fade
/// at which it does not show, and fades in with each update(); what it would see vanish fades out
/// first, and what is to take its place waits. In one update() that moves the picture by at most 0.25
/// pixels. No more than 1.55 pixels are ever held back: while more are missing no frame promises
/// anything, and what is late would only be later. So a chunk is there after 45 updates at a threshold
/// of 0.2, after 35 at 0.5, and at once at 1.55. A chunk shows at once, too, where nobody sees it come: a
/// camera's last view did not hold it, or the eye went more than a tenth of the way to it. Fades go by
/// updates, not by time: an update is a frame, and it is between two frames that a jump is seen. Ground
/// takes no part in it. Roots, and loads for contact, do not wait, but evict at once.
///
/// One thread calls update(), require() and finish(); any thread may hold and read the sets that
/// resident() returned. Root squares are pinned: the first update() asks for them.
class Pager {
public:
    /// Fails with invalid_argument for settings out of their ranges; out_of_memory where the ceiling
    /// is below the root squares.
    static Result<Pager> create(std::shared_ptr<const HeightSource> source,
                                const PagerSettings& settings);
    /// The same with a loader of the caller's in place of threads; settings.worker_count and
    /// load_timeout are of no account.
    static Result<Pager> create(std::shared_ptr<const HeightSource> source,
                                const PagerSettings& settings, std::unique_ptr<ChunkLoader> loader);

    Pager(Pager&&) noexcept;
    Pager& operator=(Pager&&) noexcept;
    /// Stops the loaders; waits for the loads in flight, but not for storage that hangs: see
    /// thread_loader.h.
    ~Pager();

    /// Takes in what arrived, asks for what is needed next, lets go of what is not. With workers it
    /// never waits for a load. What is needed is looked at twenty times a second of the clock, and
    /// at once where a camera jumps, or somebody comes or goes.
    ///
    /// @param time_s of this moment, seconds, on any clock that goes forward
    void update(std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
                double time_s);

    using Ticket = std::uint64_t;

    /// Asks for all ground of a rectangle at contact level, as before a teleport; pinned until
    /// release(). Contact goes before drawing, the earliest deadline first.
    Ticket require(const WorldRect& region, double deadline_s);
    TicketState state_of(Ticket ticket) const;
    /// Whether all of it is resident. False for a released ticket.
    bool is_ready(Ticket ticket) const;
    void release(Ticket ticket);

    /// Loads until nothing wanted by the last update() is absent, or the ceiling or a failing source
    /// stops it, and fades everything in. Waits; not for frames.
    void finish();

    /// What is resident. Never null; changes only in update() and finish().
    std::shared_ptr<const ResidentSet> resident() const;

    /// The level that ground queries answer at.
    int contact_level() const;
    PagerStats stats() const;
    /// Why the last of PagerStats::failed brought nothing, one sentence; empty where none has failed.
    std::string last_failure() const;

private:
    struct State;
    explicit Pager(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
