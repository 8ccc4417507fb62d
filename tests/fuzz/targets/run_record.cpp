// SPDX-License-Identifier: MIT
// Records of runs. The first byte chooses: changes to the content of a block or to the directory of a record (with
// hashes that are right), or to the whole file (support/input.h). The second byte chooses the kind of run. What is
// accepted is read and, for a while, replayed.
#include "record/replay.h"
#include "support/input.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

using namespace terrane;
using namespace terrane::tools;
using fuzz::require;

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr SealedKind kKind{{'T', 'R', 'U', 'N'}, 2};
constexpr double kDt = 1.0 / 60.0;
constexpr std::size_t kMemory = std::size_t{64} << 20;
constexpr std::size_t kMostSteps = 8;  // that are replayed
constexpr std::array kKinds{RunKind::flight, RunKind::drive, RunKind::walk, RunKind::drop,
                            RunKind::view};

const Terrain& terrain() {
    static const Terrain made{.source = fuzz::make_square(2.0, 0), .dem = {}, .name = "square"};
    return made;
}

/// A world with a vehicle, a character and a ball.
struct Run {
    World world = World::create({.report_contacts = true}).value();
    BodyId vehicle, character, ball;

    Run() {
        Pose pose;
        pose.translation = {40.0, 40.0, 5.0};
        vehicle = world.add_vehicle(make_truck(), pose).value();
        character = world.add_character({}, {60.0, 60.0, 5.0}).value();
        BodyState state;
        state.pose.translation = {50.0, 50.0, 5.0};
        ball = world.add({.shape = Sphere{0.5}}, state).value();
    }
};

std::vector<double> camera_of(RunKind kind, const Run& run) {
    const auto numbers = [](const auto& state) {
        return std::vector<double>(state.begin(), state.end());
    };
    if (kind == RunKind::view) return numbers(numbers_of(CameraPose()));
    if (kind == RunKind::drop)
        return numbers(DropCamera(terrain().source, run.world.states()).state());
    return numbers(ChaseCamera(*terrain().source, run.world.state(run.vehicle).pose).state());
}

/// A record in parts: its blocks' contents, and its directory.
struct Parts {
    Bytes file, directory;
    std::vector<Bytes> blocks;

    /// @param path of a file that is written over
    Parts(RunKind kind, const std::string& path) {
        const Run run;
        RunSettings settings{
            .kind = kind, .terrain = identify(terrain()), .fps = 1.0 / kDt, .dt = kDt};
        settings.traveller = kind == RunKind::walk ? run.character : run.vehicle;
        RunRecorder recorder = RunRecorder::create(path, settings).value();
        if (kind == RunKind::flight) {
            for (int i = 0; i < 3; ++i) recorder.add_pose({.eye_world = {1.0 * i, 2.0, 3.0}});
        } else {
            write_steps(kind, run, recorder);
        }
        require(recorder.commit().has_value(), "a record is written");
        std::ifstream in(path, std::ios::binary);
        file.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
        const auto reader = SealedReader::open(path, kKind).value();
        directory.assign(reader.directory().begin(), reader.directory().end());
        ByteReader places = blocks_of(directory);
        for (auto count = places.get<std::uint64_t>(); count > 0; --count) {
            std::array<std::uint64_t, 8> place{};
            places.get_each(std::span<std::uint64_t>(place));
            Bytes stored(place[1]), content(place[2]);
            require(reader.read(place[0], stored).has_value(), "a block is read");
            require(decompress(stored, content).has_value(), "a block is decompressed");
            blocks.push_back(std::move(content));
        }
    }

    static void write_steps(RunKind kind, const Run& run, RunRecorder& recorder) {
        const std::vector<double> camera = camera_of(kind, run);
        recorder.add_frame(run.world, camera, {}, {});
        for (std::size_t i = 0; i < 4; ++i) {
            recorder.add_step({DriveVehicle{run.vehicle, {.throttle = 0.5}},
                               WalkCharacter{run.character, {.velocity = {1.0, 0.0}}, {1.0, 0.0}},
                               PullBody{run.ball, {0.1, 0.0, 0.0}, {50.0, 50.0, 9.0}}});
            if (i == 1) recorder.amend(run.world.save(), {});
            if (i % 2 == 1) recorder.amend(camera);
            recorder.add_frame();
        }
        const GroundEdit ball{false, {40.0, 40.0, 0.0}, {40.0, 40.0, 0.0}, 3.0};
        recorder.ground().set(1, std::vector{ball});
        recorder.ground().set(3, {});
    }

    /// The part of a directory after the settings and the counts of frames and steps.
    static ByteReader blocks_of(const Bytes& directory) {
        ByteReader reader{directory};
        static_cast<void>(reader.get_text());
        static_cast<void>(reader.get<std::uint64_t>());
        static_cast<void>(reader.get<std::uint64_t>());
        return reader;
    }
};

/// Writes a record of these parts, with offsets, sizes and hashes that are right where the directory has places for
/// them.
void write(const std::string& path, Bytes directory, const std::vector<Bytes>& blocks) {
    SealedWriter writer = SealedWriter::create(path, kKind).value();
    ByteReader reader{directory};
    const std::size_t first = sizeof(std::uint64_t) + reader.get_text().size() + 24;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        const Bytes stored = compress(blocks[i]);
        const ContentHash hash = hash_of(stored);
        const std::uint64_t offset = writer.append(stored).value();
        ByteWriter place;
        for (const std::uint64_t number : {offset, std::uint64_t{stored.size()},
                                           std::uint64_t{blocks[i].size()}, hash.low, hash.high})
            place.put(number);
        const std::size_t at = first + i * 8 * sizeof(std::uint64_t);
        if (at + place.bytes().size() <= directory.size())
            std::ranges::copy(place.bytes(), directory.begin() + static_cast<std::ptrdiff_t>(at));
    }
    require(writer.commit(directory).has_value(), "a record is written");
}

void ask(const std::string& path) {
    Result<RunRecord> record = RunRecord::open(path);
    if (!fuzz::is_accepted(record)) return;
    if (record->settings().kind == RunKind::flight) {
        const auto poses = record->read_poses();
        if (fuzz::is_accepted(poses))
            require(poses->size() == record->frame_count(), "a flight has its frames");
        return;
    }
    for (std::size_t i = 0; i < record->block_count(); ++i)
        static_cast<void>(fuzz::is_accepted(record->read(i)));
    Result<Replay> replay = Replay::create(*std::move(record), terrain(), kMemory);
    if (!fuzz::is_accepted(replay)) return;
    while (replay->frame() + 1 < replay->record().frame_count() &&
           replay->step_count() < kMostSteps) {
        if (!fuzz::is_accepted(replay->advance())) return;
        static_cast<void>(replay->view(View()));
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFolder folder;
    static const std::string path = folder.path() + "/changed.run";
    static const std::vector<Parts> valid = [] {
        std::vector<Parts> parts;
        for (const RunKind kind : kKinds) parts.emplace_back(kind, path);
        return parts;
    }();
    fuzz::Input input(data, size);
    const int part = input.below(3);
    const Parts& parts =
        valid[static_cast<std::size_t>(input.below(static_cast<int>(valid.size())))];
    switch (part) {
        case 0:
            write(path, parts.directory, {fuzz::patched(parts.blocks[0], input)});
            break;
        case 1:
            write(path, fuzz::patched(parts.directory, input), parts.blocks);
            break;
        default:
            folder.write("changed.run", fuzz::patched(parts.file, input));
    }
    ask(path);
    return 0;
}
