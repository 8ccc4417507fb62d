// SPDX-License-Identifier: MIT
#pragma once

#include "store/test_files.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_editor.h>

#include <memory>
#include <string>
#include <vector>

namespace terrane::test {

/// Three levels of 1 m to 4 m: one root square of 512 m, 4 x 4 chunks of the finest level.
Lattice dig_lattice();

/// Hills with a tunnel, to be edited.
struct EditedWorld {
    std::shared_ptr<WaveHeights> hills;
    std::vector<VolumeOperation> base;
    std::shared_ptr<VolumeHeights> source;

    explicit EditedWorld(bool has_tunnel = true);

    /// Volumes of the base and these edits, made without an editor.
    Volumes volumes_with(const std::vector<VolumeOperation>& edits) const;
};

/// A dig or fill around one place, a few of them across the corner of four chunks at (256, 256).
VolumeOperation random_edit(Random& random, const WaveHeights& hills);

/// A pose without rotation.
Pose at(double x, double y, double z);

/// Hands an operation to an editor; its number, or 0 and a failure of the test.
std::uint32_t apply(VolumeEditor& editor, const VolumeOperation& operation);

/// A pager that keeps the whole world resident.
struct WholePager : Pager {
    WholePager(Pager&& pager, const WorldRect& world)
        : Pager(std::move(pager)), region(require(world, 0.0)) {}

    RequiredRegion region;
};
WholePager whole_world(const std::shared_ptr<const HeightSource>& source, int worker_count,
                       std::size_t memory_bytes = std::size_t{1} << 30);
/// Updates until everything is resident.
void settle(Pager& pager);

/// Where the solids of two chunks differ: empty if all of their bits are the same.
std::string difference(const SolidSurface* a, const SolidSurface* b);
/// Where a set's finest chunks differ from chunks made of the volumes alone, at most some of them.
std::string difference(const ResidentSet& set, const Volumes& volumes);
/// Where two sets' finest chunks differ.
std::string difference(const ResidentSet& a, const ResidentSet& b);

/// A folder of digs.
struct DigFolder : TemporaryFolder {
    std::string log() const { return file("digs.log"); }
    /// Paths of the chunks' files, sorted.
    std::vector<std::string> chunk_files() const { return files_in(path(), ".dig"); }
};

}  // namespace terrane::test
