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
    /// 1: a thread of its own makes what changes; 0: update() does, before it returns.
    int worker_count = 1;
    /// Folder of the log and of the chunks' files; made where there is none. Empty: nothing is kept.
    std::string folder = {};
    /// Bytes of level sets and contours held for chunks, the last used ones; beside the pager's ceiling.
    std::size_t memory_bytes = std::size_t{256} << 20;
    /// The last edits whose undo costs no more than an edit, because what was there before is held. Earlier ones are
    /// undone by applying all others again. 0 to 1024.
    int undo_depth = 8;
};

/// Counts of a VolumeEditor since its creation, except the first two.
struct VolumeEditorStats {
    std::size_t waiting = 0;      ///< changes that are not in force yet
    std::uint32_t in_force = 0;   ///< number of the last change that is
    std::uint64_t failed = 0;     ///< changes that could not be made, left out: last_failure()
    std::uint64_t postponed = 0;  ///< updates in which chunks did not fit below the pager's ceiling
    std::uint64_t completed =
        0;  ///< chunks that arrived while a change was on its way, and were made again
    std::uint64_t files_read = 0;  ///< chunks' files that saved applying edits
    std::uint64_t files_refused =
        0;  ///< damaged, foreign or newer ones; their chunks were made from the log
    std::uint64_t files_written = 0;  ///< by save()
    std::uint64_t torn_bytes =
        0;  ///< at the end of the log, of a record that was never saved whole
};

/// Digs and fills while a simulation runs.
///
/// dig(), fill() and undo() are *changes*, numbered 1, 2, ... They check and return. The owner calls update() once a
/// frame, which hands them to a thread: it applies the shape to the level sets of the tiles that it touches, contours
/// these tiles, and makes new chunks of those that are resident. A later update() brings all finished changes into
/// force at once, in the resident set of the pager's next update, so that neighbouring chunks always agree. From then
/// on chunks that are loaded have them, too. Changes that wait together make each chunk once.
///
/// Chunks that are made and not in force yet count for no ceiling; level sets and contours have one of their own.
///
///     editor.dig(VolumeSphere{2.0}, pose);
///     editor.update(pager);             // each frame
///     pager.update(cameras, bodies, t); // resident() has what update() brought into force
///
/// What a chunk is made of are the volumes of the source and the edits in force, in their order: its bits do not depend
/// on when or on which thread it was made, or whether it was resident meanwhile.
///
/// Threads: one owner calls everything. One editor and one pager for a source.
class VolumeEditor {
public:
    /// Opens the log of settings.folder, if there is one, and brings it into force: call it before a pager loads.
    ///
    /// @param source is changed by this editor from now on
    ///
    /// Fails: invalid_argument for settings out of range; io for a folder that cannot be made or a log that cannot be
    ///        read; bad_data for a log that is damaged before its end, newer, or of other volumes. Files are left alone
    ///        then.
    /// Cost:  O(edits * chunks that they touch); no level set is made
    static Result<VolumeEditor> create(std::shared_ptr<VolumeHeights> source,
                                       const VolumeEditorSettings& settings = {});
    VolumeEditor(VolumeEditor&&) noexcept;
    VolumeEditor& operator=(VolumeEditor&&) noexcept;
    /// Waits for the change that the thread is at; later ones are given up. Saves nothing.
    ~VolumeEditor();

    /// Takes a shape from the solid; later changes prevail. Returns the number of the change.
    ///
    /// @param shape a sphere, capsule, box or tube; metres
    ///
    /// Fails: invalid_argument as PlacedVolume::create(): numbers that are not finite, a shape thinner than a voxel or
    ///        larger than 1e5 m, or outside the world; and for meshes and files. Then nothing changes.
    /// Cost:  O(tiles that it touches)
    Result<std::uint32_t> dig(const VolumeShape& shape, const Pose& world_from_shape);
    /// Unites a shape with the solid; else as dig().
    Result<std::uint32_t> fill(const VolumeShape& shape, const Pose& world_from_shape);

    /// Takes back the last dig or fill that was not taken back, whether it is in force or still on its way. A change
    /// with a number of its own.
    ///
    /// Fails: invalid_argument if there is none
    Result<std::uint32_t> undo();

    /// Begins the changes so far, and brings those into force whose chunks are made, in their order. Call it between
    /// the pager's updates, once a frame. A change waits where a chunk that it touches has arrived meanwhile and is
    /// still being made, and where chunks do not fit below the pager's ceiling, until others have been evicted.
    ///
    /// Returns: the number of the last change in force
    /// Cost:    O(chunks swapped); with worker_count = 0 that of making them
    std::uint32_t update(Pager& pager);
    /// The same where no pager has loaded from the source yet; waits until all changes are in force.
    std::uint32_t update();

    /// Blocks until what update() has begun is made; the next update() brings it into force. Not for a frame.
    void wait();

    /// Appends the changes in force to the log, flushes it to the disk, and writes the files of chunks that have
    /// changed since theirs and whose level sets are held. Blocks: not for a frame.
    ///
    /// Fails: invalid_argument without a folder; io, as for a full disk: then log and files are as they were, and the
    ///        next call tries again. Chunks' files are only a shortcut: nothing is lost without one.
    Result<void> save();

    /// What has happened so far.
    VolumeEditorStats stats() const;
    /// Why the last change or file was refused, one sentence; empty if none was.
    std::string last_failure() const;

private:
    struct State;
    explicit VolumeEditor(std::unique_ptr<State> state);
    Result<std::uint32_t> edit(VolumeOp op, const VolumeShape& shape, const Pose& world_from_shape);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
