// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_heights.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace terrane {

/// Settings of a VolumeEditor.
struct VolumeEditorSettings {
    /// 1: changes are prepared on a worker thread; 0: update() prepares them before it returns.
    int worker_count = 1;
    /// Folder of the log and of the chunk files; created if absent. Empty: nothing is saved.
    std::string folder = {};
    /// Cache of level sets and contours of chunks, bytes, least recently used evicted first; not part of the pager's
    /// ceiling.
    std::size_t memory_bytes = std::size_t{256} << 20;
    /// Number of most recent edits whose previous state is kept, so that undoing one costs no more than an edit.
    /// Earlier edits are undone by applying all others again. 0 to 1024.
    int undo_depth = 8;
};

/// State of a VolumeEditor (the first two members) and counts since its creation.
struct VolumeEditorStats {
    std::size_t waiting = 0;      ///< changes that are not in force yet
    std::uint32_t in_force = 0;   ///< number of the last change in force
    std::uint64_t failed = 0;     ///< failed attempts to prepare a change: see last_failure()
    std::uint64_t postponed = 0;  ///< times that new chunks did not fit below the pager's ceiling
    /// Chunks made again, because they were loaded while a change to them was being prepared.
    std::uint64_t completed = 0;
    std::uint64_t files_read = 0;  ///< chunk files that were read instead of applying edits again
    /// Chunk files refused as damaged, foreign or newer; their chunks were made from the log.
    std::uint64_t files_refused = 0;
    std::uint64_t files_written = 0;  ///< chunk files written by save()
    std::uint64_t torn_bytes = 0;     ///< bytes of an incomplete last record, dropped from the log
};

/// Digs and fills while a simulation runs.
///
/// dig(), fill() and undo() submit *changes*, numbered 1, 2, ... They check their arguments and return. The owner calls
/// update() once a frame, which passes the changes to a worker thread. The worker applies each shape to the level sets
/// of the tiles that it touches, contours these tiles, and makes new chunks in place of the resident ones. A later
/// A later update() lets all finished changes take effect at once, in the resident set of the pager's next update, so
/// that neighbouring chunks always agree. Chunks loaded afterwards include the changes. A chunk that several waiting
/// changes touch is made once.
///
/// No ceiling limits chunks that are made but not yet in force; memory_bytes limits level sets and contours.
///
///     editor.dig(VolumeSphere{2.0}, pose);
///     editor.update(pager);             // each frame
///     pager.update(cameras, bodies, t); // resident() now includes the changes in force
///
/// A chunk depends only on the volumes of the source and on the edits in force, in their order. Its bits do not depend
/// on when or on which thread it was made, or on whether it was resident meanwhile.
///
/// Threads: one owner calls everything. One editor and one pager per source.
class VolumeEditor {
public:
    /// Opens the log of settings.folder, if there is one, and puts its changes into effect. Call it before a pager
    /// loads from the source.
    ///
    /// @param source changed by this editor from now on
    ///
    /// Fails: invalid_argument for settings out of range; io for a folder that cannot be created or a log that cannot
    ///        be read; bad_data for a log that is damaged before its end, of a newer version, or of other volumes.
    ///        Files are not modified then.
    /// Cost:  O(edits * chunks that they touch); computes no level sets
    static Result<VolumeEditor> create(std::shared_ptr<VolumeHeights> source,
                                       const VolumeEditorSettings& settings = {});
    VolumeEditor(VolumeEditor&&) noexcept;
    VolumeEditor& operator=(VolumeEditor&&) noexcept;
    /// Waits for the change in progress and discards later ones. Saves nothing.
    ~VolumeEditor();

    /// Removes a shape from the solid; later changes prevail. Returns the number of the change.
    ///
    /// @param shape a sphere, capsule, box or tube; metres
    ///
    /// Fails: invalid_argument as PlacedVolume::create(): numbers that are not finite, a shape thinner than a voxel,
    ///        larger than 1e5 m or outside the world; and for meshes and files. Nothing changes then.
    /// Cost:  O(tiles that it touches)
    Result<std::uint32_t> dig(const VolumeShape& shape, const Pose& world_from_shape);
    /// Unites a shape with the solid; otherwise as dig().
    Result<std::uint32_t> fill(const VolumeShape& shape, const Pose& world_from_shape);

    /// Undoes the last dig or fill that has not been undone, in force or not. The undo is a change with its own number.
    ///
    /// Fails: invalid_argument if there is none
    Result<std::uint32_t> undo();

    /// Starts all changes submitted so far, and lets those whose chunks are finished take effect, in order. Call it
    /// once a frame, between the pager's updates. A change also waits while a chunk that was loaded in the meantime is
    /// made for it, and until evictions let its new chunks fit below the pager's ceiling.
    ///
    /// Returns: the number of the last change in force
    /// Cost:    O(chunks swapped); with worker_count = 0 also the making of the chunks
    std::uint32_t update(Pager& pager);
    /// As above, before any pager has loaded from the source; blocks until all changes are in force.
    std::uint32_t update();

    /// Blocks until the work that update() started is finished; its changes take effect in the next update(). Not for
    /// use in a frame.
    void wait();

    /// Appends the changes in force to the log, flushes it to the disk, and writes the files of chunks that have
    /// changed since their file was written and whose level sets are held. Blocks: not for use in a frame.
    ///
    /// Fails: invalid_argument without a folder; io, for example if the disk is full: log and files are then as before,
    ///        and the next call tries again. A missing chunk file costs only time: the chunk is made from the log.
    Result<void> save();

    /// Counts so far.
    VolumeEditorStats stats() const;
    /// Why the last change or file failed, one sentence; empty if none did.
    std::string last_failure() const;

private:
    struct State;
    explicit VolumeEditor(std::unique_ptr<State> state);
    Result<std::uint32_t> edit(VolumeOp op, const VolumeShape& shape, const Pose& world_from_shape);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
