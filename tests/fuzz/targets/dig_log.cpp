// SPDX-License-Identifier: MIT
// Logs of digs: records with hashes that are right, of edits, undos and any bytes; then any bytes at the end. The log
// is replayed, and dug on.
#include "level_set/shapes.h"
#include "support/input.h"

#include <terrane/store/sealed_file.h>
#include <terrane/terrain/chunk.h>
#include <terrane/volume/volume_editor.h>

#include <array>
#include <filesystem>
#include <vector>

using namespace terrane;
using fuzz::require;

namespace {

constexpr std::array<char, 8> kMagic{'T', 'R', 'N', 'D', 'I', 'G', 'S', '\n'};
constexpr double kLow = 0.0, kHigh = 128.0;  // of the ground, metres

/// Flat ground with a hall.
std::shared_ptr<VolumeHeights> make_ground() {
    static const auto flat = fuzz::make_square(0.0, 0);
    VolumeOperation hall{.shape = VolumeSphere{6.0}, .voxel = 1.0};
    hall.world_from_shape.translation = {64.0, 64.0, -12.0};
    static const Volumes volumes = Volumes::create(flat->lattice(), std::array{hall}).value();
    return VolumeHeights::create(flat, volumes).value();
}

VolumeShape take_volume(fuzz::Input& input) {
    constexpr double kLeast = 0.5, kMost = 12.0;
    switch (input.below(6)) {
        case 0:
            return VolumeSphere{input.number(kLeast, kMost)};
        case 1: {
            VolumeCapsule capsule;
            capsule.radius = input.number(kLeast, kMost);
            capsule.half_height = input.number(0.0, kMost);
            return capsule;
        }
        case 2:
            return VolumeBox{input.vector(kLeast, kMost)};
        case 3: {
            VolumeTube tube;
            tube.radius = input.number(kLeast, kMost);
            for (int count = input.below(8); count > 0; --count) {
                tube.path_shape.push_back(input.vector(-kMost, kMost));
            }
            return tube;
        }
        case 4: {
            VolumeMesh mesh;
            for (int count = input.below(8); count > 0; --count) {
                mesh.points_shape.push_back(input.vector(-kMost, kMost));
            }
            for (int count = input.below(16); count > 0; --count) {
                mesh.triangles.push_back({input.byte(), input.byte(), input.byte()});
            }
            return mesh;
        }
        default:
            return VolumeFile{"none.vdb", ""};
    }
}

/// The content of a record.
std::vector<std::uint8_t> take_record(fuzz::Input& input, std::uint32_t next) {
    ByteWriter out;
    const int kind = input.below(8);
    if (kind == 7) {
        out.put_each(input.bytes(input.byte()));
        return out.bytes();
    }
    out.put(kind == 6 ? static_cast<std::uint32_t>(input.bits(4)) : next);
    const bool is_undo = input.below(4) == 3;
    out.put(std::uint8_t{is_undo});
    if (is_undo) {
        out.put(next - 1 - input.byte());
        return out.bytes();
    }
    VolumeOperation operation{.op = input.flag() ? VolumeOp::remove : VolumeOp::add,
                              .shape = take_volume(input)};
    operation.world_from_shape = fuzz::take_pose(input, kLow, kHigh);
    operation.world_from_shape.translation.z() /= 8.0;
    operation.voxel = input.number(0.5, 2.0);
    internal::put(out, operation);
    return out.bytes();
}

/// A log in the format of edit/edit_files.h.
std::vector<std::uint8_t> take_log(fuzz::Input& input,
                                   const std::array<std::uint64_t, 2>& fingerprint) {
    ByteWriter out;
    out.put_each(std::span<const char>(kMagic));
    out.put(std::uint32_t{1});
    out.put_each(std::span<const std::uint64_t>(fingerprint));
    out.put(hash_of(out.bytes()).low);
    std::uint64_t hash = 0;
    const int count = input.below(8);
    for (int i = 0; i < count; ++i) {
        const std::vector<std::uint8_t> content =
            take_record(input, static_cast<std::uint32_t>(i + 1));
        ByteWriter chained;
        chained.put(hash);
        chained.put_each(std::span<const std::uint8_t>(content));
        hash = hash_of(chained.bytes()).low;
        out.put(static_cast<std::uint32_t>(content.size()));
        out.put_each(std::span<const std::uint8_t>(content));
        out.put(hash);
    }
    out.put_each(input.rest());
    return out.bytes();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFolder folder;
    fuzz::Input input(data, size);
    const std::shared_ptr<VolumeHeights> ground = make_ground();
    folder.write("digs.log", take_log(input, ground->volumes().fingerprint()));
    auto editor = VolumeEditor::create(ground, {.worker_count = 0, .folder = folder.path()});
    if (!fuzz::is_accepted(editor)) return 0;
    const std::uint32_t before = editor->stats().in_force;
    Pose pose;
    pose.translation = {40.0, 40.0, 0.0};
    const Result<std::uint32_t> dug = editor->dig(VolumeSphere{2.0}, pose);
    require(dug && *dug > before, "digs go on with the next number");
    require(editor->update() == *dug, "a dig comes into force");
    const auto chunk = make_chunk(*ground, {0, 0, 0});
    if (!chunk) require(chunk.error().code != ErrorCode::bad_data, chunk.error().message);
    require(editor->undo().has_value(), "a dig can be taken back");
    editor->update();
    return 0;
}
