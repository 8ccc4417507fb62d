// SPDX-License-Identifier: MIT
#include "record/run_record.h"

#include <terrane/store/bytes.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr SealedKind kKind{{'T', 'R', 'U', 'N'}, 1};
constexpr double kBlockSeconds = 5.0;                // of a run with bodies
constexpr std::size_t kPosesInBlock = 4096;          // of a flight
constexpr std::uint64_t kMostBlockBytes = 1u << 31;  // sizes in a file are not trusted
constexpr std::array<const char*, 4> kKindNames{"fly", "drive", "walk", "drop"};

}  // namespace

std::string name_of(RunKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

Result<void> apply(const RunAction& action, World& world) {
    if (const auto* drive = std::get_if<DriveVehicle>(&action))
        return world.set_controls(drive->vehicle, drive->controls);
    const auto& walk = std::get<WalkCharacter>(action);
    return world.set_controls(walk.character, walk.controls);
}

TerrainIdentity identify(const Terrain& terrain) {
    constexpr int kSide = 16;  // points of the grid that is sampled
    const WorldRect region = work_region(terrain);
    const WorldRect& extent = terrain.source->extent();
    const Lattice& lattice = terrain.source->lattice();
    ByteWriter bytes;
    for (const double number : {extent.west, extent.south, extent.east, extent.north,
                                lattice.origin_x, lattice.origin_y, lattice.spacing})
        bytes.put(number);
    for (const std::size_t count :
         {terrain.bodies.size(), terrain.objects ? terrain.objects->objects.size() : 0,
          terrain.objects ? terrain.objects->scatters.size() : 0,
          std::size_t{terrain.volumes != nullptr}})
        bytes.put(static_cast<std::uint64_t>(count));
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const double height = terrain.source->height(
                region.west + (x + 0.5) / kSide * (region.east - region.west),
                region.south + (y + 0.5) / kSide * (region.north - region.south));
            bytes.put(std::isnan(height) ? std::numeric_limits<double>::infinity() : height);
        }
    }
    return {terrain.name, hash_of(bytes.bytes()).text()};
}

std::uint64_t hash_of_state(const World& world, std::span<const double> camera,
                            const CharacterGait& gait) {
    ByteWriter bytes;
    bytes.put(world.state_hash());
    bytes.put_each(camera);
    for (const double number : {gait.heading.x(), gait.heading.y(), gait.walked}) bytes.put(number);
    return hash_of(bytes.bytes()).low;
}

namespace {

// ---- Numbers ----

// Numbers that change little from one to the next: each as its difference in bits from the one before, the bytes of
// equal significance together, which compress well.
void put_series(ByteWriter& out, std::span<const double> numbers) {
    const std::size_t count = numbers.size();
    std::vector<std::uint8_t> planes(sizeof(double) * count);
    std::uint64_t before = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto bits = std::bit_cast<std::uint64_t>(numbers[i]);
        const std::uint64_t change = bits ^ std::exchange(before, bits);
        for (std::size_t byte = 0; byte < sizeof(double); ++byte)
            planes[byte * count + i] = static_cast<std::uint8_t>(change >> (8 * byte));
    }
    out.put_each(std::span<const std::uint8_t>(planes));
}

std::vector<double> get_series(ByteReader& in, std::size_t count) {
    std::vector<std::uint8_t> planes(sizeof(double) * count);
    in.get_each(std::span(planes));
    std::vector<double> numbers(count);
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t byte = 0; byte < sizeof(double); ++byte)
            bits ^= std::uint64_t{planes[byte * count + i]} << (8 * byte);
        numbers[i] = std::bit_cast<double>(bits);
    }
    return numbers;
}

void put_bytes(ByteWriter& out, std::span<const std::byte> bytes) {
    out.put(static_cast<std::uint64_t>(bytes.size()));
    out.put_each(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
}

/// The reader of a block, which refuses counts that its bytes cannot have.
class BlockReader : public ByteReader {
public:
    explicit BlockReader(std::span<const std::uint8_t> bytes)
        : ByteReader(bytes), most_(bytes.size()) {}

    /// A count of items of at least one byte.
    std::size_t count() {
        const auto number = get<std::uint64_t>();
        if (number <= most_) return static_cast<std::size_t>(number);
        is_wrong_ = true;
        return 0;
    }
    bool is_whole() const { return is_done() && !is_wrong_; }

    std::vector<std::byte> bytes() {
        std::vector<std::byte> bytes(count());
        get_each(std::span(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()));
        return bytes;
    }
    std::vector<double> numbers() {
        std::vector<double> numbers(std::min(count(), most_ / sizeof(double)));
        get_each(std::span(numbers));
        return numbers;
    }

private:
    std::size_t most_;
    bool is_wrong_ = false;
};

void put_numbers(ByteWriter& out, std::span<const double> numbers) {
    out.put(static_cast<std::uint64_t>(numbers.size()));
    out.put_each(numbers);
}

// ---- Blocks ----

// The fields of actions as columns: numbers of an action, as get_numbers() and make_action() have them.
constexpr std::size_t kActionNumbers = 3;

BodyId body_of(const RunAction& action) {
    const auto* drive = std::get_if<DriveVehicle>(&action);
    return drive != nullptr ? drive->vehicle : std::get<WalkCharacter>(action).character;
}

std::array<double, kActionNumbers> numbers_of(const RunAction& action) {
    if (const auto* drive = std::get_if<DriveVehicle>(&action))
        return {drive->controls.throttle, drive->controls.brake, drive->controls.steer};
    const CharacterControls& controls = std::get<WalkCharacter>(action).controls;
    return {controls.velocity.x(), controls.velocity.y(), controls.jump_speed};
}

RunAction make_action(std::size_t kind, const BodyId& body,
                      const std::array<double, kActionNumbers>& numbers) {
    if (kind == 0)
        return DriveVehicle{body,
                            {.throttle = numbers[0], .brake = numbers[1], .steer = numbers[2]}};
    return WalkCharacter{body, {.velocity = {numbers[0], numbers[1]}, .jump_speed = numbers[2]}};
}

// Bits of a step's flags.
constexpr std::uint8_t kHasWorld = 1, kHasCamera = 2;

std::vector<std::uint8_t> encode(const RunBlock& block) {
    ByteWriter out;
    put_bytes(out, block.start.world);
    put_numbers(out, block.start.camera);
    const CharacterGait& gait = block.start.gait;
    for (const double number : {gait.heading.x(), gait.heading.y(), gait.walked}) out.put(number);
    out.put(block.start.last.awake);
    out.put(block.start.last.touching_pairs);
    out.put(block.start.last.max_depth_m);
    out.put(block.start_frame_count);

    out.put(static_cast<std::uint64_t>(block.steps.size()));
    std::vector<RunAction> actions;
    for (const RunStep& step : block.steps) {
        const int flags =
            (step.world.empty() ? 0 : kHasWorld) | (step.camera.empty() ? 0 : kHasCamera);
        out.put(static_cast<std::uint8_t>(flags));
        out.put(step.frame_count);
        out.put(static_cast<std::uint32_t>(step.actions.size()));
        actions.insert(actions.end(), step.actions.begin(), step.actions.end());
    }
    out.put(static_cast<std::uint64_t>(actions.size()));
    for (const RunAction& action : actions) {
        out.put(static_cast<std::uint8_t>(action.index()));
        out.put(body_of(action).index);
        out.put(body_of(action).generation);
    }
    std::vector<double> series(actions.size());
    for (std::size_t number = 0; number < kActionNumbers; ++number) {
        std::ranges::transform(actions, series.begin(),
                               [&](const RunAction& action) { return numbers_of(action)[number]; });
        put_series(out, series);
    }
    for (const RunStep& step : block.steps) {
        if (!step.world.empty()) put_bytes(out, step.world);
        if (!step.camera.empty()) put_numbers(out, step.camera);
    }
    return out.bytes();
}

bool decode(std::span<const std::uint8_t> bytes, RunBlock& block_out) {
    BlockReader in(bytes);
    block_out.start.world = in.bytes();
    block_out.start.camera = in.numbers();
    CharacterGait& gait = block_out.start.gait;
    for (double* number : {&gait.heading.x(), &gait.heading.y(), &gait.walked})
        *number = in.get<double>();
    block_out.start.last.awake = in.get<std::uint64_t>();
    block_out.start.last.touching_pairs = in.get<std::uint64_t>();
    block_out.start.last.max_depth_m = in.get<double>();
    block_out.start_frame_count = in.get<std::uint32_t>();

    block_out.steps.resize(in.count());
    std::vector<std::uint8_t> flags;
    std::vector<std::uint32_t> action_counts;
    for (RunStep& step : block_out.steps) {
        flags.push_back(in.get<std::uint8_t>());
        step.frame_count = in.get<std::uint32_t>();
        action_counts.push_back(in.get<std::uint32_t>());
    }
    const std::size_t action_count = in.count();
    std::vector<std::uint8_t> kinds(action_count);
    std::vector<BodyId> bodies(action_count);
    for (std::size_t i = 0; i < action_count; ++i) {
        kinds[i] = in.get<std::uint8_t>();
        bodies[i].index = in.get<std::uint32_t>();
        bodies[i].generation = in.get<std::uint32_t>();
        if (kinds[i] >= std::variant_size_v<RunAction>) return false;
    }
    std::array<std::vector<double>, kActionNumbers> columns;
    for (std::vector<double>& column : columns) column = get_series(in, action_count);
    std::size_t next = 0;
    for (std::size_t i = 0; i < block_out.steps.size(); ++i) {
        RunStep& step = block_out.steps[i];
        if (action_counts[i] > action_count - next) return false;
        for (std::uint32_t k = 0; k < action_counts[i]; ++k, ++next)
            step.actions.push_back(make_action(
                kinds[next], bodies[next], {columns[0][next], columns[1][next], columns[2][next]}));
        if ((flags[i] & kHasWorld) != 0) step.world = in.bytes();
        if ((flags[i] & kHasCamera) != 0) step.camera = in.numbers();
    }
    return in.is_whole() && next == action_count;
}

constexpr std::size_t kPoseNumbers = 12;

std::array<double, kPoseNumbers> numbers_of(const CameraPose& pose) {
    std::array<double, kPoseNumbers> numbers{};
    std::size_t next = 0;
    for (const Eigen::Vector3d& v : {pose.eye_world, pose.forward, pose.up, pose.velocity}) {
        for (int axis = 0; axis < 3; ++axis) numbers[next++] = v[axis];
    }
    return numbers;
}

std::vector<std::uint8_t> encode(std::span<const CameraPose> poses) {
    ByteWriter out;
    out.put(static_cast<std::uint64_t>(poses.size()));
    std::vector<double> series(poses.size());
    for (std::size_t number = 0; number < kPoseNumbers; ++number) {
        std::ranges::transform(poses, series.begin(),
                               [&](const CameraPose& pose) { return numbers_of(pose)[number]; });
        put_series(out, series);
    }
    return out.bytes();
}

bool decode(std::span<const std::uint8_t> bytes, std::vector<CameraPose>& poses_out) {
    BlockReader in(bytes);
    const std::size_t count = in.count();
    std::array<std::vector<double>, kPoseNumbers> columns;
    for (std::vector<double>& column : columns) column = get_series(in, count);
    for (std::size_t i = 0; i < count; ++i) {
        CameraPose pose;
        std::size_t next = 0;
        for (Eigen::Vector3d* v : {&pose.eye_world, &pose.forward, &pose.up, &pose.velocity}) {
            for (int axis = 0; axis < 3; ++axis) (*v)[axis] = columns[next++][i];
        }
        poses_out.push_back(pose);
    }
    return in.is_whole();
}

// ---- Settings ----

Json to_json(const RunSettings& settings) {
    Json json;
    json["command"] = name_of(settings.kind);
    json["terrain_flags"] = settings.terrain_flags;
    json["terrain"] = settings.terrain.name;
    json["terrain_hash"] = settings.terrain.hash;
    json["fps"] = settings.fps;
    if (settings.kind == RunKind::flight) return json;
    json["dt"] = settings.dt;
    json["contact_spacing_m"] = settings.contact_spacing;
    if (settings.kind == RunKind::drop) {
        json["first_scene_body"] = settings.first_scene_body;
        json["mesh_file"] = settings.mesh_file;
        json["mesh_scale"] = settings.mesh_scale;
        return json;
    }
    const ChaseCameraSettings& camera = settings.camera;
    json["camera"] = {camera.behind, camera.above, camera.target_above, camera.bearing};
    json["traveller"] = {settings.traveller.index, settings.traveller.generation};
    json["crates"] = settings.crate_count;
    return json;
}

// Throws a Json::exception for missing keys and values of another type.
RunSettings from_json(const Json& json) {
    RunSettings settings;
    const auto name = json.at("command").get<std::string>();
    const auto kind = std::find(kKindNames.begin(), kKindNames.end(), name);
    settings.kind = static_cast<RunKind>(kind == kKindNames.end() ? 0 : kind - kKindNames.begin());
    json.at("terrain_flags").get_to(settings.terrain_flags);
    json.at("terrain").get_to(settings.terrain.name);
    json.at("terrain_hash").get_to(settings.terrain.hash);
    json.at("fps").get_to(settings.fps);
    if (settings.kind == RunKind::flight) return settings;
    json.at("dt").get_to(settings.dt);
    json.at("contact_spacing_m").get_to(settings.contact_spacing);
    if (settings.kind == RunKind::drop) {
        json.at("first_scene_body").get_to(settings.first_scene_body);
        json.at("mesh_file").get_to(settings.mesh_file);
        json.at("mesh_scale").get_to(settings.mesh_scale);
        return settings;
    }
    const Json& camera = json.at("camera");
    settings.camera = {camera.at(0).get<double>(), camera.at(1).get<double>(),
                       camera.at(2).get<double>(), camera.at(3).get<double>()};
    settings.traveller = {json.at("traveller").at(0).get<std::uint32_t>(),
                          json.at("traveller").at(1).get<std::uint32_t>()};
    json.at("crates").get_to(settings.crate_count);
    return settings;
}

}  // namespace

RunRecorder::RunRecorder(std::string path, SealedWriter writer, RunSettings settings)
    : path_(std::move(path)),
      writer_(std::move(writer)),
      if_killed_(std::make_unique<RemovedIfKilled>(writer_.written_path())),
      settings_(std::move(settings)) {}

Result<RunRecorder> RunRecorder::create(const std::string& path, RunSettings settings) {
    TERRANE_TRY(SealedWriter writer, SealedWriter::create(path, kKind));
    return RunRecorder(path, std::move(writer), std::move(settings));
}

void RunRecorder::add_step(std::vector<RunAction> actions) {
    block_->steps.push_back({.actions = std::move(actions)});
    ++step_count_;
}

void RunRecorder::amend(const World& world) { block_->steps.back().world = world.save(); }

void RunRecorder::amend(std::span<const double> camera) {
    block_->steps.back().camera.assign(camera.begin(), camera.end());
}

void RunRecorder::add_frame(const World& world, std::span<const double> camera,
                            const CharacterGait& gait, const StepFigures& last) {
    const std::uint64_t frame = frame_count_++;
    const bool is_due =
        !block_ || static_cast<double>(step_count_ - block_step_) * settings_.dt >= kBlockSeconds;
    if (!is_due) {
        const bool is_start = block_->steps.empty();
        ++(is_start ? block_->start_frame_count : block_->steps.back().frame_count);
        return;
    }
    end_block();
    block_.emplace();
    block_->start = {world.save(), {camera.begin(), camera.end()}, gait, last};
    block_frame_ = frame;
    block_step_ = step_count_;
    block_hash_ = hash_of_state(world, camera, gait);
}

void RunRecorder::add_pose(const CameraPose& pose) {
    if (poses_.size() == kPosesInBlock) end_block();
    if (poses_.empty()) block_frame_ = frame_count_;
    poses_.push_back(pose);
    ++frame_count_;
}

void RunRecorder::end_block() {
    if (!written_ || (!block_ && poses_.empty())) return;
    const std::vector<std::uint8_t> content = block_ ? encode(*block_) : encode(poses_);
    const std::vector<std::uint8_t> stored = compress(content);
    block_.reset();
    poses_.clear();
    const Result<std::uint64_t> offset = writer_.append(stored);
    if (!offset) {
        written_ = tl::unexpected(offset.error());
        return;
    }
    blocks_.push_back({*offset, stored.size(), content.size(), hash_of(stored), block_frame_,
                       block_step_, block_hash_});
}

Result<void> RunRecorder::commit() {
    end_block();
    TERRANE_TRY(written_);
    ByteWriter directory;
    directory.put_text(to_json(settings_).dump());
    directory.put(frame_count_);
    directory.put(step_count_);
    directory.put(static_cast<std::uint64_t>(blocks_.size()));
    for (const StoredBlock& block : blocks_) {
        for (const std::uint64_t number :
             {block.offset, block.stored_bytes, block.content_bytes, block.hash.low,
              block.hash.high, block.first_frame, block.first_step, block.state_hash})
            directory.put(number);
    }
    return writer_.commit(directory.bytes());
}

Result<RunRecord> RunRecord::open(const std::string& path) {
    TERRANE_TRY(SealedReader file, SealedReader::open(path, kKind));
    RunRecord record(std::move(file));
    TERRANE_TRY(record.read_directory());
    for (std::size_t i = 0; i < record.blocks_.size(); ++i) TERRANE_TRY(record.content(i));
    return record;
}

Result<void> RunRecord::read_directory() {
    const auto bad = [&] {
        return fail(ErrorCode::bad_data,
                    fmt::format("the record '{}' has an invalid directory", path()));
    };
    BlockReader in(file_.directory());
    try {
        settings_ = from_json(Json::parse(in.get_text()));
    } catch (const Json::exception& error) {
        return fail(ErrorCode::bad_data,
                    fmt::format("the record '{}' has invalid settings: {}", path(), error.what()));
    }
    frame_count_ = in.get<std::uint64_t>();
    step_count_ = in.get<std::uint64_t>();
    blocks_.resize(in.count());
    for (RunRecorder::StoredBlock& block : blocks_) {
        for (std::uint64_t* number :
             {&block.offset, &block.stored_bytes, &block.content_bytes, &block.hash.low,
              &block.hash.high, &block.first_frame, &block.first_step, &block.state_hash})
            *number = in.get<std::uint64_t>();
        if (block.content_bytes > kMostBlockBytes || block.stored_bytes > file_.bytes() ||
            block.first_frame >= frame_count_)
            return bad();
    }
    const bool is_valid = in.is_whole() && !blocks_.empty() && blocks_[0].first_frame == 0 &&
                          settings_.fps > 0.0 &&
                          (settings_.kind == RunKind::flight || settings_.dt > 0.0);
    return is_valid ? Result<void>() : bad();
}

std::size_t RunRecord::frame_at(double time) const {
    constexpr double kRounding = 1e-6;  // frames; times of frames are rounded
    const double frame = std::floor(time * settings_.fps + kRounding);
    return static_cast<std::size_t>(std::clamp(frame, 0.0, static_cast<double>(frame_count_ - 1)));
}

std::size_t RunRecord::block_of(std::size_t frame) const {
    const auto after = std::upper_bound(blocks_.begin(), blocks_.end(), frame,
                                        [](std::size_t at, const RunRecorder::StoredBlock& block) {
                                            return at < block.first_frame;
                                        });
    return static_cast<std::size_t>(after - blocks_.begin()) - 1;
}

Result<std::vector<std::uint8_t>> RunRecord::content(std::size_t index) const {
    const RunRecorder::StoredBlock& block = blocks_[index];
    std::vector<std::uint8_t> stored(block.stored_bytes), content(block.content_bytes);
    TERRANE_TRY(file_.read(block.offset, stored));
    if (hash_of(stored) == block.hash) {
        const Result<std::size_t> size = decompress(stored, content);
        if (size && *size == content.size()) return content;
    }
    return fail(ErrorCode::bad_data, fmt::format("the record '{}' is damaged after frame {}",
                                                 path(), block.first_frame));
}

Result<RunBlock> RunRecord::read(std::size_t index) const {
    TERRANE_TRY(const std::vector<std::uint8_t> bytes, content(index));
    RunBlock block;
    if (decode(bytes, block)) return block;
    return fail(ErrorCode::bad_data, fmt::format("the record '{}' has an invalid block at frame {}",
                                                 path(), first_frame(index)));
}

Result<std::vector<CameraPose>> RunRecord::read_poses() const {
    std::vector<CameraPose> poses;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
        TERRANE_TRY(const std::vector<std::uint8_t> bytes, content(i));
        if (!decode(bytes, poses)) break;
    }
    if (poses.size() == frame_count_) return poses;
    return fail(ErrorCode::bad_data,
                fmt::format("the record '{}' has other frames than it says", path()));
}

Result<void> RunRecord::check_terrain(const Terrain& terrain) const {
    const TerrainIdentity here = identify(terrain);
    if (here.hash == settings_.terrain.hash) return {};
    return fail(ErrorCode::invalid_argument,
                fmt::format("the record '{}' is of another terrain: it was made over '{}', and its "
                            "heights are not those of '{}'",
                            path(), settings_.terrain.name, here.name));
}

}  // namespace terrane::tools
