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

constexpr SealedKind kKind{{'T', 'R', 'U', 'N'}, 2};
// Level: blocks of a vehicle are 2 % larger than with 3, in two thirds of the time.
constexpr int kCompression = -1;
constexpr double kBlockSeconds = 5.0;                // of a run with bodies
constexpr std::size_t kPosesInBlock = 4096;          // of a flight
constexpr std::uint64_t kMostBlockBytes = 1u << 31;  // sizes in a file are not trusted
constexpr std::array<const char*, 5> kKindNames{"fly", "drive", "walk", "drop", "view"};
// of the spring that pulls a body, per kilogram
constexpr double kPull = 80.0;         // N/m
constexpr double kPullDamping = 14.0;  // N s/m
constexpr double kMostPull = 400.0;    // N

}  // namespace

std::string name_of(RunKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

namespace {

Result<void> pull(const PullBody& action, World& world) {
    if (!world.contains(action.body))
        return fail(ErrorCode::invalid_argument, "the body that is pulled is not in the world");
    const BodyState& state = world.state(action.body);
    const double mass = world.settings(action.body).mass;
    const WorldPos grip = state.pose * action.grip_body;
    const Eigen::Vector3d arm = grip - state.pose.translation;
    const Eigen::Vector3d& w = state.angular_velocity;
    const Eigen::Vector3d turning(w.y() * arm.z() - w.z() * arm.y(),
                                  w.z() * arm.x() - w.x() * arm.z(),
                                  w.x() * arm.y() - w.y() * arm.x());
    Eigen::Vector3d force =
        mass * (kPull * (action.hand_world - grip) - kPullDamping * (state.velocity + turning));
    const double most = mass * kMostPull;
    if (force.norm() > most) force *= most / force.norm();
    return world.add_force(action.body, grip, force);
}

}  // namespace

Result<void> apply(const RunAction& action, World& world) {
    if (const auto* drive = std::get_if<DriveVehicle>(&action))
        return world.set_controls(drive->vehicle, drive->controls);
    if (const auto* walk = std::get_if<WalkCharacter>(&action))
        return world.set_controls(walk->character, walk->controls);
    return pull(std::get<PullBody>(action), world);
}

void advance_gait(const WalkCharacter& walk, const CharacterState& state, double dt,
                  CharacterGait& gait) {
    if (walk.heading.isZero()) {
        gait.follow(state, walk.controls, dt);
        return;
    }
    gait.heading = walk.heading;
    gait.walk(state, dt);
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

StepFigures figures_of(const StepReport& report) {
    return {report.awake, report.touching_pairs, report.max_depth_m};
}

CameraState<kPoseNumbers> numbers_of(const CameraPose& pose) {
    CameraState<kPoseNumbers> numbers{};
    std::size_t next = 0;
    for (const Eigen::Vector3d& v : {pose.eye_world, pose.forward, pose.up, pose.velocity}) {
        for (int axis = 0; axis < 3; ++axis) numbers[next++] = v[axis];
    }
    return numbers;
}

CameraPose pose_of(const CameraState<kPoseNumbers>& numbers) {
    CameraPose pose;
    std::size_t next = 0;
    for (Eigen::Vector3d* v : {&pose.eye_world, &pose.forward, &pose.up, &pose.velocity}) {
        for (int axis = 0; axis < 3; ++axis) (*v)[axis] = numbers[next++];
    }
    return pose;
}

std::uint64_t hash_of_state(std::uint64_t world_hash, std::span<const double> camera,
                            const CharacterGait& gait) {
    ByteWriter bytes;
    bytes.put(world_hash);
    bytes.put_each(camera);
    for (const double number : {gait.heading.x(), gait.heading.y(), gait.walked}) bytes.put(number);
    return hash_of(bytes.bytes()).low;
}

namespace {

// ---- Numbers ----

// Columns of numbers that change little from one row to the next: each as its difference in bits from the one before,
// the bytes of equal significance together, which compress well.
class ColumnWriter {
public:
    /// @param row_count rows of the columns
    ColumnWriter(ByteWriter& out, std::size_t row_count)
        : out_(&out), planes_(sizeof(double) * row_count), row_count_(row_count) {}

    /// Writes a column whose number in a row is number_at(row).
    template <class NumberAt>
    void put(const NumberAt& number_at) {
        std::uint64_t before = 0;
        for (std::size_t row = 0; row < row_count_; ++row) {
            const auto bits = std::bit_cast<std::uint64_t>(static_cast<double>(number_at(row)));
            std::uint64_t change = bits ^ std::exchange(before, bits);
            for (std::size_t at = row; at < planes_.size(); at += row_count_, change >>= 8)
                planes_[at] = static_cast<std::uint8_t>(change);
        }
        out_->put_each(std::span<const std::uint8_t>(planes_));
    }

private:
    ByteWriter* out_;
    std::vector<std::uint8_t> planes_;
    std::size_t row_count_;
};

std::vector<double> get_column(ByteReader& in, std::size_t row_count) {
    std::vector<std::uint8_t> planes(sizeof(double) * row_count);
    in.get_each(std::span(planes));
    std::vector<double> numbers(row_count);
    std::uint64_t bits = 0;
    for (std::size_t row = 0; row < row_count; ++row) {
        for (std::size_t byte = 0; byte < sizeof(double); ++byte)
            bits ^= std::uint64_t{planes[byte * row_count + row]} << (8 * byte);
        numbers[row] = std::bit_cast<double>(bits);
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

    /// A count of items of at least so many bytes.
    std::size_t count(std::size_t item_bytes = 1) {
        const auto number = get<std::uint64_t>();
        if (number <= most_ / item_bytes) return static_cast<std::size_t>(number);
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
        std::vector<double> numbers(count(sizeof(double)));
        get_each(std::span(numbers));
        return numbers;
    }

    template <StoredNumber T>
    std::vector<T> values(std::size_t count_of_values) {
        std::vector<T> values(count_of_values);
        get_each(std::span(values));
        return values;
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

void put_gait(ByteWriter& out, const CharacterGait& gait) {
    for (const double number : {gait.heading.x(), gait.heading.y(), gait.walked}) out.put(number);
}

CharacterGait get_gait(ByteReader& in) {
    CharacterGait gait;
    for (double* number : {&gait.heading.x(), &gait.heading.y(), &gait.walked})
        *number = in.get<double>();
    return gait;
}

// The numbers of an action, of which each kind has its own count.
constexpr std::size_t kMostActionNumbers = 6;
using ActionNumbers = std::array<double, kMostActionNumbers>;
constexpr std::array<std::size_t, std::variant_size_v<RunAction>> kActionNumbers{3, 5, 6};

BodyId body_of(const RunAction& action) {
    if (const auto* drive = std::get_if<DriveVehicle>(&action)) return drive->vehicle;
    if (const auto* walk = std::get_if<WalkCharacter>(&action)) return walk->character;
    return std::get<PullBody>(action).body;
}

ActionNumbers action_numbers(const RunAction& action) {
    if (const auto* drive = std::get_if<DriveVehicle>(&action))
        return {drive->controls.throttle, drive->controls.brake, drive->controls.steer};
    if (const auto* walk = std::get_if<WalkCharacter>(&action)) {
        const CharacterControls& controls = walk->controls;
        return {controls.velocity.x(), controls.velocity.y(), controls.jump_speed,
                walk->heading.x(), walk->heading.y()};
    }
    const auto& pull = std::get<PullBody>(action);
    return {pull.grip_body.x(),  pull.grip_body.y(),  pull.grip_body.z(),
            pull.hand_world.x(), pull.hand_world.y(), pull.hand_world.z()};
}

RunAction make_action(std::size_t kind, const BodyId& body, const ActionNumbers& numbers) {
    const auto& [a, b, c, d, e, f] = numbers;
    if (kind == 0) return DriveVehicle{body, {.throttle = a, .brake = b, .steer = c}};
    if (kind == 1) return WalkCharacter{body, {.velocity = {a, b}, .jump_speed = c}, {d, e}};
    return PullBody{body, {a, b, c}, {d, e, f}};
}

void put_actions(ByteWriter& out, std::span<const RunAction> actions) {
    std::vector<std::uint8_t> kinds;
    std::vector<std::uint32_t> bodies;
    std::array<std::vector<ActionNumbers>, std::variant_size_v<RunAction>> of_kind;
    kinds.reserve(actions.size());
    bodies.reserve(2 * actions.size());
    for (const RunAction& action : actions) {
        kinds.push_back(static_cast<std::uint8_t>(action.index()));
        const BodyId body = body_of(action);
        bodies.insert(bodies.end(), {body.index, body.generation});
        of_kind[action.index()].push_back(action_numbers(action));
    }
    out.put(static_cast<std::uint64_t>(actions.size()));
    out.put_each(std::span<const std::uint8_t>(kinds));
    out.put_each(std::span<const std::uint32_t>(bodies));
    for (std::size_t kind = 0; kind < of_kind.size(); ++kind) {
        const std::vector<ActionNumbers>& rows = of_kind[kind];
        ColumnWriter columns(out, rows.size());
        for (std::size_t column = 0; column < kActionNumbers[kind]; ++column)
            columns.put([&](std::size_t row) { return rows[row][column]; });
    }
}

bool get_actions(BlockReader& in, std::vector<RunAction>& actions_out) {
    const std::size_t count = in.count(sizeof(std::uint8_t) + 2 * sizeof(std::uint32_t));
    const auto kinds = in.values<std::uint8_t>(count);
    const auto bodies = in.values<std::uint32_t>(2 * count);
    std::array<std::vector<ActionNumbers>, std::variant_size_v<RunAction>> of_kind;
    for (std::size_t kind = 0; kind < of_kind.size(); ++kind) {
        of_kind[kind].resize(static_cast<std::size_t>(std::ranges::count(kinds, kind)));
        for (std::size_t column = 0; column < kActionNumbers[kind]; ++column) {
            const std::vector<double> numbers = get_column(in, of_kind[kind].size());
            for (std::size_t row = 0; row < numbers.size(); ++row)
                of_kind[kind][row][column] = numbers[row];
        }
    }
    std::array<std::size_t, std::variant_size_v<RunAction>> next{};
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t kind = kinds[i];
        if (kind >= of_kind.size()) return false;
        actions_out.push_back(
            make_action(kind, {bodies[2 * i], bodies[2 * i + 1]}, of_kind[kind][next[kind]++]));
    }
    return true;
}

// Bits of a step's flags.
constexpr std::uint8_t kHasWorld = 1, kHasCamera = 2;

std::vector<std::uint8_t> encode(const RunBlock& block) {
    ByteWriter out;
    put_bytes(out, block.start.world);
    put_numbers(out, block.start.camera);
    put_gait(out, block.start.gait);
    out.put(block.start.last.awake);
    out.put(block.start.last.touching_pairs);
    out.put(block.start.last.max_depth_m);
    out.put(block.start_frame_count);

    std::vector<std::uint8_t> flags;
    std::vector<std::uint32_t> counts;  // of frames and of actions
    std::vector<RunAction> actions;
    std::vector<const std::vector<double>*> cameras;
    flags.reserve(block.steps.size());
    counts.reserve(2 * block.steps.size());
    actions.reserve(block.steps.size());
    for (const RunStep& step : block.steps) {
        flags.push_back(static_cast<std::uint8_t>((step.world.empty() ? 0 : kHasWorld) |
                                                  (step.camera.empty() ? 0 : kHasCamera)));
        counts.insert(counts.end(),
                      {step.frame_count, static_cast<std::uint32_t>(step.actions.size())});
        actions.insert(actions.end(), step.actions.begin(), step.actions.end());
        if (!step.camera.empty()) cameras.push_back(&step.camera);
    }
    out.put(static_cast<std::uint64_t>(block.steps.size()));
    out.put_each(std::span<const std::uint8_t>(flags));
    out.put_each(std::span<const std::uint32_t>(counts));
    put_actions(out, actions);
    const std::size_t camera_size = cameras.empty() ? 0 : cameras[0]->size();
    out.put(static_cast<std::uint64_t>(camera_size));
    ColumnWriter columns(out, cameras.size());
    for (std::size_t column = 0; column < camera_size; ++column)
        columns.put([&](std::size_t row) { return (*cameras[row])[column]; });
    for (const RunStep& step : block.steps) {
        if (step.world.empty()) continue;
        put_bytes(out, step.world);
        put_gait(out, step.gait);
    }
    return out.bytes();
}

bool decode(std::span<const std::uint8_t> bytes, RunBlock& block_out) {
    BlockReader in(bytes);
    block_out.start.world = in.bytes();
    block_out.start.camera = in.numbers();
    block_out.start.gait = get_gait(in);
    block_out.start.last.awake = in.get<std::uint64_t>();
    block_out.start.last.touching_pairs = in.get<std::uint64_t>();
    block_out.start.last.max_depth_m = in.get<double>();
    block_out.start_frame_count = in.get<std::uint32_t>();

    const std::size_t step_count = in.count(sizeof(std::uint8_t) + 2 * sizeof(std::uint32_t));
    const auto flags = in.values<std::uint8_t>(step_count);
    const auto counts = in.values<std::uint32_t>(2 * step_count);
    std::vector<RunAction> actions;
    if (!get_actions(in, actions)) return false;
    const std::size_t camera_size = in.count(sizeof(double));
    std::vector<std::vector<double>*> cameras;
    block_out.steps.resize(step_count);
    auto next = actions.begin();
    for (std::size_t i = 0; i < step_count; ++i) {
        RunStep& step = block_out.steps[i];
        step.frame_count = counts[2 * i];
        const std::uint32_t action_count = counts[2 * i + 1];
        if (action_count > actions.end() - next) return false;
        step.actions.assign(next, next + action_count);
        next += action_count;
        if ((flags[i] & kHasCamera) != 0) cameras.push_back(&step.camera);
    }
    for (std::size_t column = 0; column < camera_size && !in.has_failed(); ++column) {
        const std::vector<double> numbers = get_column(in, cameras.size());
        for (std::size_t row = 0; row < numbers.size(); ++row)
            cameras[row]->push_back(numbers[row]);
    }
    for (std::size_t i = 0; i < step_count; ++i) {
        if ((flags[i] & kHasWorld) == 0) continue;
        block_out.steps[i].world = in.bytes();
        block_out.steps[i].gait = get_gait(in);
    }
    return in.is_whole() && next == actions.end();
}

std::vector<std::uint8_t> encode(std::span<const CameraPose> poses) {
    ByteWriter out;
    out.put(static_cast<std::uint64_t>(poses.size()));
    std::vector<CameraState<kPoseNumbers>> rows;
    for (const CameraPose& pose : poses) rows.push_back(numbers_of(pose));
    ColumnWriter columns(out, rows.size());
    for (std::size_t column = 0; column < kPoseNumbers; ++column)
        columns.put([&](std::size_t row) { return rows[row][column]; });
    return out.bytes();
}

bool decode(std::span<const std::uint8_t> bytes, std::vector<CameraPose>& poses_out) {
    BlockReader in(bytes);
    std::vector<CameraState<kPoseNumbers>> rows(in.count(sizeof(double)));
    for (std::size_t column = 0; column < kPoseNumbers; ++column) {
        const std::vector<double> numbers = get_column(in, rows.size());
        for (std::size_t row = 0; row < rows.size(); ++row) rows[row][column] = numbers[row];
    }
    for (const CameraState<kPoseNumbers>& row : rows) poses_out.push_back(pose_of(row));
    return in.is_whole();
}

// ---- Ground ----

constexpr std::size_t kEditNumbers = 7;

std::array<double, kEditNumbers> edit_numbers(const GroundEdit& edit) {
    const WorldPos &from = edit.from_world, &to = edit.to_world;
    return {from.x(), from.y(), from.z(), to.x(), to.y(), to.z(), edit.radius};
}

void put_ground(ByteWriter& out, std::span<const GroundLog::Entry> entries) {
    out.put(static_cast<std::uint64_t>(entries.size()));
    std::vector<std::array<double, kEditNumbers>> rows;
    for (const GroundLog::Entry& entry : entries) {
        out.put(static_cast<std::uint8_t>(entry.edit.fills));
        out.put(entry.first_step);
        out.put(entry.end_step);
        rows.push_back(edit_numbers(entry.edit));
    }
    ColumnWriter columns(out, rows.size());
    for (std::size_t column = 0; column < kEditNumbers; ++column)
        columns.put([&](std::size_t row) { return rows[row][column]; });
}

GroundLog get_ground(BlockReader& in) {
    std::vector<GroundLog::Entry> entries(
        in.count(sizeof(std::uint8_t) + 2 * sizeof(std::uint64_t)));
    for (GroundLog::Entry& entry : entries) {
        entry.edit.fills = in.get<std::uint8_t>() != 0;
        entry.first_step = in.get<std::uint64_t>();
        entry.end_step = in.get<std::uint64_t>();
    }
    for (std::size_t column = 0; column < kEditNumbers; ++column) {
        const std::vector<double> numbers = get_column(in, entries.size());
        for (std::size_t row = 0; row < entries.size(); ++row) {
            GroundEdit& edit = entries[row].edit;
            const auto axis = static_cast<Eigen::Index>(column % 3);
            double& number = column == 6  ? edit.radius
                             : column < 3 ? edit.from_world[axis]
                                          : edit.to_world[axis];
            number = numbers[row];
        }
    }
    return GroundLog(std::move(entries));
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
    json["dig_spacing_m"] = settings.dig_spacing;
    if (settings.kind == RunKind::view) return json;
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
    json.at("dig_spacing_m").get_to(settings.dig_spacing);
    if (settings.kind == RunKind::view) return settings;
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

void RunRecorder::amend(std::vector<std::byte> world, const CharacterGait& gait) {
    block_->steps.back().world = std::move(world);
    block_->steps.back().gait = gait;
}

void RunRecorder::amend(std::span<const double> camera) {
    block_->steps.back().camera.assign(camera.begin(), camera.end());
}

bool RunRecorder::needs_state() const {
    return !block_ ||
           static_cast<double>(step_count_ - block_step_) * settings_.dt >= kBlockSeconds;
}

void RunRecorder::add_frame() {
    ++frame_count_;
    const bool is_start = block_->steps.empty();
    ++(is_start ? block_->start_frame_count : block_->steps.back().frame_count);
}

void RunRecorder::add_frame(RunState state, std::uint64_t state_hash) {
    end_block();
    block_.emplace();
    block_->start = std::move(state);
    block_->steps.reserve(1 + static_cast<std::size_t>(kBlockSeconds / settings_.dt));
    block_frame_ = frame_count_++;
    block_step_ = step_count_;
    block_hash_ = state_hash;
}

void RunRecorder::add_frame(const World& world, std::span<const double> camera,
                            const CharacterGait& gait, const StepFigures& last) {
    if (!needs_state()) {
        add_frame();
        return;
    }
    add_frame({world.save(), {camera.begin(), camera.end()}, gait, last},
              hash_of_state(world.state_hash(), camera, gait));
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
    const std::vector<std::uint8_t> stored = compress(content, kCompression);
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
    put_ground(directory, ground_.entries());
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
    blocks_.resize(in.count(8 * sizeof(std::uint64_t)));
    for (RunRecorder::StoredBlock& block : blocks_) {
        for (std::uint64_t* number :
             {&block.offset, &block.stored_bytes, &block.content_bytes, &block.hash.low,
              &block.hash.high, &block.first_frame, &block.first_step, &block.state_hash})
            *number = in.get<std::uint64_t>();
        if (block.content_bytes > kMostBlockBytes || block.stored_bytes > file_.bytes() ||
            block.first_frame >= frame_count_)
            return bad();
    }
    ground_ = get_ground(in);
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
