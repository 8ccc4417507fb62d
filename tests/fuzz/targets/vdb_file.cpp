// SPDX-License-Identifier: MIT
// `.vdb` files: changes to the bytes of a real one (support/input.h).
#include "support/input.h"

#include <terrane/volume/volumes.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <sstream>
#include <vector>

// OpenVDB's reader leaks the nodes that it has read when it throws.
// NOLINTNEXTLINE(readability-identifier-naming): the sanitizer's name
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
    return "leak:readTopology\nleak:readBuffers\n";
}

using namespace terrane;

namespace {

/// A ball, as the stream or the file that its last byte says: uncompressed, so that voxels can be changed.
std::vector<std::uint8_t> ball() {
    openvdb::initialize();
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(3.0f, openvdb::Vec3f(0.0f),
                                                                         1.0f, 3.0f);
    grid->setName("ball");
    std::ostringstream out(std::ios::binary);
    openvdb::io::Stream stream(out);
    stream.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(openvdb::GridCPtrVec{grid});
    const std::string text = out.str();
    return {text.begin(), text.end()};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFolder folder;
    static const std::vector<std::uint8_t> valid = ball();
    fuzz::Input input(data, size);
    const std::string path = folder.write("ball.vdb", fuzz::patched(valid, input));
    const Lattice lattice{.spacing = 1.0};
    VolumeOperation operation{.op = VolumeOp::remove, .shape = VolumeFile{path, ""}, .voxel = 1.0};
    operation.world_from_shape.translation = {64.0, 64.0, 40.0};
    const auto placed =
        PlacedVolume::create(lattice, 0, operation, {.memory_bytes = std::size_t{32} << 20});
    if (!fuzz::is_accepted(placed)) return 0;
    for (const double z : {30.0, 37.5, 40.0, 42.9, 60.0}) {
        fuzz::require(std::isfinite(placed->signed_distance({64.2, 63.9, z})),
                      "a distance is finite");
    }
    return 0;
}
