// SPDX-License-Identifier: MIT
#include "commands/run_files.h"
#include "flight/cameras.h"
#include "flight/flight_output.h"
#include "program/command.h"
#include "program/geometry.h"
#include "program/options.h"
#include "program/output_file.h"
#include "program/progress.h"
#include "program/summary.h"
#include "record/run_bodies.h"
#include "scene/body_placement.h"
#include "scene/scene_bodies.h"
#include "scene/terrain_options.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/pager.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::tools {

/// Loads a world from a file with the bytes of World::save(). Fails with io if it cannot be read, and as World::load();
/// messages name the file.
Result<World> restore_world(const std::string& path, int worker_count);

/// When the frames of a drop are due, and their camera.
class DropFrames {
public:
    /// @param world at the start
    DropFrames(const Terrain& terrain, const World& world, double fps)
        : camera_(terrain.source, world.states()), fps_(fps) {}

    /// Time of the next frame, seconds from the start. It shows the state after the first step that ends then or later.
    double due() const { return static_cast<double>(count_) / fps_; }
    /// Moves the camera for the next frame.
    void begin(const World& world) {
        if (count_++ > 0) camera_.follow(world.states(), 1.0 / fps_);
    }
    const DropCamera& camera() const { return camera_; }

private:
    DropCamera camera_;
    double fps_;
    std::size_t count_ = 0;  // frames begun
};

/// Pictures of the bodies of a drop, with frames.csv and report.html. Has its own pager, so that drawing does not
/// affect the simulation.
class DropFilm {
public:
    /// @param options    fps, size, fov_deg, out, png and video are used
    /// @param first_body index in the world of the scene's first body, or of one before it
    ///
    /// Fails as FlightOutput and FrameMaker.
    static Result<DropFilm> create(const FlightOptions& options, const Terrain& terrain,
                                   const World& world, std::size_t first_body,
                                   const DropCamera& camera);

    /// Shows a mesh file for all bodies of a shape: see BodyNodes::set_mesh().
    void set_mesh(const Shape& shape, const std::string& path, double scale) {
        nodes_.set_mesh(shape, path, scale);
    }

    /// Makes the frame for one time, seconds. Fails with io.
    Result<void> show(const World& world, const StepFigures& last, const DropCamera& camera,
                      double time);

    /// Completes all files, and adds frames, renderer, samples and out to the summary. Fails with io.
    Result<void> finish(const std::string& title, nlohmann::ordered_json& summary);

private:
    DropFilm(const FlightOptions& options, FrameMaker maker, FlightOutput output, BodyNodes nodes,
             DropBodies bodies)
        : options_(options),
          maker_(std::move(maker)),
          output_(std::move(output)),
          nodes_(std::move(nodes)),
          bodies_(std::move(bodies)) {}

    FlightOptions options_;
    FrameMaker maker_;
    FlightOutput output_;
    BodyNodes nodes_;
    DropBodies bodies_;
};

Result<World> restore_world(const std::string& path, int worker_count) {
    // checked first, because a folder would open as an empty stream
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::is_regular_file(status)) {
        return fail(ErrorCode::io, "cannot restore '" + path +
                                       "': " + (error ? error.message() : "it is not a file"));
    }
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file),
                                  std::istreambuf_iterator<char>()};
    if (!file.good() && !file.eof()) {
        return fail(ErrorCode::io, "cannot restore '" + path + "': it cannot be read");
    }
    Result<World> world = World::load(std::as_bytes(std::span(bytes)), {}, worker_count);
    if (!world) {
        return fail(world.error().code, "cannot restore '" + path + "': " + world.error().message);
    }
    return world;
}

Result<DropFilm> DropFilm::create(const FlightOptions& options, const Terrain& terrain,
                                  const World& world, std::size_t first_body,
                                  const DropCamera& camera) {
    TERRANE_TRY(FrameMaker maker,
                FrameMaker::create(terrain.source, frame_maker_settings(options)));
    TERRANE_TRY(FlightOutput output, FlightOutput::create(options, terrain, drop_columns()));
    TERRANE_TRY(BodyNodes nodes, output.add_bodies(terrain, maker));
    DropBodies bodies(terrain, world, first_body, nodes);
    maker.load_until_stable(camera.view(make_view(options.size, options.fov_deg)), {}, 0.0);
    return DropFilm(options, std::move(maker), std::move(output), std::move(nodes),
                    std::move(bodies));
}

Result<void> DropFilm::show(const World& world, const StepFigures& last, const DropCamera& camera,
                            double time) {
    const View view = camera.view(make_view(options_.size, options_.fov_deg));
    TERRANE_TRY(bodies_.show(world, nodes_));
    MadeFrame frame = maker_.make({.view = view, .velocity = camera.velocity()}, {}, time);
    frame.record.extra = drop_figures(last);
    return output_.add(std::move(frame), view);
}

Result<void> DropFilm::finish(const std::string& title, nlohmann::ordered_json& summary) {
    // the report also shows the cost of the frames; the summary of the drop does not
    nlohmann::ordered_json of_frames = summary;
    of_frames.update(summarize(output_.frames(), options_.memory_bytes(), options_.fps));
    TERRANE_TRY(output_.finish(title, of_frames));
    for (const char* key : {"frames", "renderer", "samples", "out"}) summary[key] = of_frames[key];
    return {};
}

namespace {

constexpr double kMaxSteps = 1e8;
constexpr std::size_t kMostThreads = 64;
constexpr std::size_t kMostDropped = 10'000'000;

struct DropOptions {
    TerrainOptions terrain;
    DropLayout layout;
    std::string shape_file;  ///< of --shape file:PATH; "" for none
    double proxy_error = kUsualProxyError;
    FlightOptions film;  ///< only what add_picture_options() adds is used
    double dt = 1.0 / 60.0;
    double substep = WorldSettings{}.max_substep;
    double seconds = 10.0;
    double contact_spacing_m = 0.0;
    double memory_mb = 1024.0;
    std::size_t threads = 1;
    bool no_sleep = false;
    std::string trace;
    std::string save, restore;  ///< files of a world; "" for none
    std::string record;         ///< a file; "" for none
    bool json = false;
};

/// Sums and maxima over steps.
struct DropTotals {
    std::uint64_t fell_through = 0;
    std::uint64_t parked = 0;
    std::uint64_t left_world = 0;
    std::uint64_t awake_body_steps = 0;
    double simulated_time = 0.0;
    double lost_time = 0.0;
    double max_depth_m = 0.0;
    std::vector<double> step_ms;

    void add(const StepReport& report, double ms) {
        fell_through += report.too_deep;
        parked += report.parked;
        left_world = report.left_world;  // bodies outside the extent after this step
        awake_body_steps += report.awake;
        simulated_time += report.simulated_time;
        lost_time += report.lost_time;
        max_depth_m = std::max(max_depth_m, report.max_depth_m);
        step_ms.push_back(ms);
    }
};

/// The quantile of the values for a share: 0.5 gives the median. Requires at least one value.
double quantile(std::vector<double> values, double share) {
    const auto rank =
        static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                     values.end());
    return values[rank];
}

std::size_t count_steps(const DropOptions& options) {
    return static_cast<std::size_t>(std::max(1.0, std::floor(options.seconds / options.dt + 0.5)));
}

void write_poses(OutputFile& trace, std::size_t step, std::span<const BodyState> states) {
    fmt::memory_buffer lines;
    for (std::size_t body = 0; body < states.size(); ++body) {
        const WorldPos& p_world = states[body].pose.translation;
        const Quaternion q = quaternion_from_matrix(states[body].pose.rotation);
        fmt::format_to(std::back_inserter(lines),
                       "{},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", step,
                       body, p_world.x(), p_world.y(), p_world.z(), q[0], q[1], q[2], q[3]);
    }
    trace.write({lines.data(), lines.size()});
}

/// The world of --restore.
CommandResult<World> reopen_world(const DropOptions& options, Pager& pager) {
    pager.update({}, {}, 0.0);
    TERRANE_TRY(World world, restore_world(options.restore, static_cast<int>(options.threads)));
    if (world.states().empty()) {
        return failure(fmt::format("the world in '{}' has no bodies", options.restore));
    }
    return world;
}

/// Loads the ground below the starts and creates the bodies above it.
CommandResult<World> make_world(const DropOptions& options, const Terrain& terrain,
                                const ObjectBodies& objects, Pager& pager) {
    WorldSettings settings;
    settings.allow_sleep = !options.no_sleep;
    settings.max_substep = options.substep;
    settings.worker_count = static_cast<int>(options.threads);
    TERRANE_TRY(World world, World::create(settings));
    TERRANE_TRY(World obstacles, World::create({}));
    for (const std::span<const PlacedBody> each : {std::span(terrain.bodies), objects.placed()}) {
        TERRANE_TRY(add_bodies(each, obstacles));
    }
    pager.update({}, {}, 0.0);
    const WorldRect area = drop_area(options.layout, pager.resident()->extent());
    const double margin = 10.0;  // metres: widest shape plus a cell
    RequiredRegion required = pager.require(
        {area.west - margin, area.south - margin, area.east + margin, area.north + margin}, 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    if (pager.stats().failed > 0) return failure("the terrain's heights could not be read");
    if (!required.is_ready()) {
        return failure(fmt::format(
            "--memory-mb {:.6g} is too small for the ground of the start, {:.6g} x {:.6g} m",
            options.memory_mb, area.east - area.west, area.north - area.south));
    }
    const std::vector<PlacedBody> bodies = lay_out(options.layout, pager.ground(), obstacles);
    required.release();
    if (bodies.size() != options.layout.count) {
        return failure(fmt::format(
            "only {} of {} bodies find free ground in the {:.6g} x {:.6g} m around the start",
            bodies.size(), options.layout.count, area.east - area.west, area.north - area.south));
    }
    for (const std::span<const PlacedBody> each :
         {std::span(bodies), std::span(terrain.bodies), objects.placed()}) {
        TERRANE_TRY(add_bodies(each, world));
    }
    return world;
}

CommandResult<DropTotals> simulate(const DropOptions& options, const Terrain& terrain,
                                   ObjectBodies& objects, Pager& pager, World& world,
                                   DropFrames& frames, OutputFile* trace, DropFilm* film,
                                   RunRecorder* recorder) {
    using Clock = std::chrono::steady_clock;
    const std::size_t step_count = count_steps(options);
    Progress progress("dropping");
    DropTotals totals;
    totals.step_ms.reserve(step_count);
    if (trace != nullptr) write_poses(*trace, 0, world.states());
    StepReport report;
    report.awake = world.states().size();
    const bool has_frames = film != nullptr || recorder != nullptr;
    const auto show_until = [&](double time) -> Result<void> {
        const StepFigures last = figures_of(report);
        while (has_frames && frames.due() <= time) {
            const double due = frames.due();
            frames.begin(world);
            if (film != nullptr) TERRANE_TRY(film->show(world, last, frames.camera(), due));
            if (recorder != nullptr)
                recorder->add_frame(world, frames.camera().state(), CharacterGait(), last);
        }
        return {};
    };
    TERRANE_TRY(show_until(0.0));
    for (std::size_t step = 1; step <= step_count && !is_interrupted(); ++step) {
        progress.show(static_cast<double>(step) / static_cast<double>(step_count));
        const double time = options.dt * static_cast<double>(step);
        pager.update({}, world.needs(), time);
        const Ground ground = pager.ground(terrain.surface);
        TERRANE_TRY(objects.follow(world, ground));
        const Clock::time_point begin = Clock::now();
        report = world.step(ground, options.dt);
        totals.add(report, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
        if (recorder != nullptr) {
            recorder->add_step({});
            if (report.parked > 0) recorder->amend(world.save(), CharacterGait());
        }
        TERRANE_TRY(show_until(time));
        if (trace == nullptr) continue;
        write_poses(*trace, step, world.states());
        if (trace->has_failed()) break;  // commit() reports the cause
    }
    return totals;
}

CommandResult<void> run_drop(const DropOptions& options, const CLI::App& command) {
    if (options.seconds / options.dt > kMaxSteps) {
        return usage_error(
            fmt::format("--seconds {:.6g} with --dt {:.6g} is more than {:.6g} steps",
                        options.seconds, options.dt, kMaxSteps));
    }
    TERRANE_TRY(check_pictures(options.film));
    if (options.layout.count == 0 && options.terrain.scene.empty()) {
        return usage_error("--count 0 leaves nothing to drop: only a --scene has other bodies");
    }
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--size", "--fov-deg"}, !options.film.out.empty(), "goes with --out DIR"},
         {{"--fps"},
          !options.film.out.empty() || !options.record.empty(),
          "goes with --out DIR or --record FILE"},
         {{"--shape", "--scale", "--count", "--speed", "--spin", "--substep", "--no-sleep"},
          options.restore.empty(),
          "is in the world that --restore reads"},
         {{"--proxy-error"}, !options.shape_file.empty(), "goes with --shape file:PATH"}}));
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    TERRANE_TRY(check_memory(terrain, options.memory_mb));
    if (options.restore.empty() && options.layout.count == 0 && terrain.bodies.empty()) {
        return failure(fmt::format("--count 0 leaves nothing to drop: the scene '{}' has no bodies",
                                   options.terrain.scene));
    }
    DropOptions with_seed = options;
    with_seed.layout.seed = options.terrain.seed.value_or(1);
    with_seed.layout.start = terrain.start;
    if (!options.shape_file.empty()) {
        TERRANE_TRY(Shape shape,
                    read_mesh_body(options.shape_file, options.proxy_error, options.layout.scale));
        with_seed.layout.file_shape = std::move(shape);
    }
    // Without workers every step has the ground that the bodies need: no body is parked and no figure depends on
    // timing. A horizon of two steps is then sufficient.
    TERRANE_TRY(Pager pager,
                Pager::create(terrain.source,
                              {.memory_bytes = static_cast<std::size_t>(options.memory_mb * 0x1p20),
                               .worker_count = 0,
                               .horizon = 2.0 * options.dt,
                               .contact_spacing = options.contact_spacing_m}));
    TERRANE_TRY(ObjectBodies objects, ObjectBodies::create(terrain.source, terrain.objects.get()));
    TERRANE_TRY(World world, options.restore.empty()
                                 ? make_world(with_seed, terrain, objects, pager)
                                 : reopen_world(options, pager));

    watch_for_interrupts();
    std::optional<OutputFile> trace;
    if (!options.trace.empty()) {
        TERRANE_TRY(OutputFile file, OutputFile::create(options.trace));
        trace.emplace(std::move(file));
        trace->write("step,body,x,y,z,qw,qx,qy,qz\n");
    }
    std::optional<OutputFile> saved;
    if (!options.save.empty()) {
        TERRANE_TRY(OutputFile file, OutputFile::create(options.save));
        saved.emplace(std::move(file));
    }
    const DropLayout& layout = with_seed.layout;
    // the number of dropped bodies in a restored world is not known
    const std::size_t first_body = options.restore.empty() ? layout.count : 0;
    TERRANE_TRY(std::optional<RunRecorder> recorder,
                begin_record(options.record, command, terrain,
                             {.kind = RunKind::drop,
                              .fps = options.film.fps,
                              .dt = options.dt,
                              .contact_spacing = options.contact_spacing_m,
                              .first_scene_body = first_body,
                              .mesh_file = options.shape_file,
                              .mesh_scale = layout.scale}));
    DropFrames frames(terrain, world, options.film.fps);
    std::optional<DropFilm> film;
    if (!options.film.out.empty()) {
        TERRANE_TRY(DropFilm made,
                    DropFilm::create(options.film, terrain, world, first_body, frames.camera()));
        film.emplace(std::move(made));
        if (layout.file_shape) film->set_mesh(*layout.file_shape, options.shape_file, layout.scale);
    }
    TERRANE_TRY(const DropTotals totals,
                simulate(options, terrain, objects, pager, world, frames, trace ? &*trace : nullptr,
                         film ? &*film : nullptr, recorder ? &*recorder : nullptr));
    if (trace) {
        TERRANE_TRY(trace->commit());
    }
    if (saved) {
        const std::vector<std::byte> bytes = world.save();
        saved->write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        TERRANE_TRY(saved->commit());
    }

    const std::size_t steps_done = totals.step_ms.size();
    const bool is_cut_short = steps_done < count_steps(options);
    if (steps_done == 0) return failure("interrupted before the first step");
    const double all_time = totals.simulated_time + totals.lost_time;
    nlohmann::ordered_json summary;
    summary["bodies"] = world.states().size();
    summary["steps"] = steps_done;
    if (is_cut_short) summary["interrupted"] = true;
    summary["fell_through"] = totals.fell_through;
    summary["parked"] = totals.parked;
    summary["left_world"] = totals.left_world;
    summary["lost_time_share"] = all_time > 0.0 ? totals.lost_time / all_time : 0.0;
    summary["awake_body_steps"] = totals.awake_body_steps;
    summary["max_depth_m"] = totals.max_depth_m;
    summary["step_ms_median"] = quantile(totals.step_ms, 0.5);
    summary["step_ms_p99"] = quantile(totals.step_ms, 0.99);
    summary["peak_bytes"] = pager.stats().peak_bytes;
    summary["state_hash"] = hash_text(world.state_hash());
    if (film) {
        TERRANE_TRY(film->finish("Drop onto " + terrain.name, summary));
    }
    TERRANE_TRY(end_record(recorder, world.state_hash(), summary));
    print_summary(summary, options.json);
    if (is_cut_short) {
        return failure(
            fmt::format("interrupted after {} of {} steps", steps_done, count_steps(options)));
    }
    return {};
}

}  // namespace

void add_drop_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<DropOptions>();
    options->film.threads = 0;  // chunks load inside the update, so that every frame has ground
    CLI::App* drop = app.add_subcommand(
        "drop",
        "Drops bodies onto the ground around --start-m, among those of the scene, and "
        "counts what goes wrong");
    add_terrain_options(*drop, options->terrain,
                        {"bodies", "surface", "volumes", "objects", "nodes", "imagery", "materials",
                         "water", "water_m"});
    const std::vector<std::string> shapes{"sphere", "capsule", "box", "hull", "compound", "mixed"};
    drop->add_option_function<std::string>(
            "--shape",
            [to = options.get(), shapes](const std::string& text) {
                constexpr std::string_view kFile = "file:";
                const bool is_file = text.starts_with(kFile) && text.size() > kFile.size();
                to->shape_file = is_file ? text.substr(kFile.size()) : "";
                to->layout.shape =
                    is_file ? DropShape::file
                            : static_cast<DropShape>(read_choice("--shape", shapes, text));
            },
            "sphere (radius 0.5 m), capsule (0.4, half height 0.8), box (half extents 1, 2, 0.5), "
            "hull (a stone of six corners), compound (a hammer), or mixed, which alternates "
            "the first three; or file:PATH, a closed mesh in a PLY or OBJ file, as convex hulls")
        ->default_str("sphere")
        ->type_name("NAME");
    add_in_range(*drop, "--proxy-error", options->proxy_error, 0.0, 1e6,
                 "Largest distance between a mesh file's solid and its hulls, metres");
    add_in_range(*drop, "--scale", options->layout.scale, 1e-3, 1e3,
                 "Of all lengths: shapes, distances between them, and heights above the ground");
    add_count(*drop, "--count", options->layout.count, 0,
              "Bodies besides those of the scene; 0 only with a scene that has some", kMostDropped);
    add_in_range(*drop, "--speed", options->layout.speed, -1e6, 1e6, "Downward at the start, m/s");
    add_in_range(*drop, "--spin", options->layout.spin, -1e6, 1e6,
                 "At the start, about a random axis of each body, rad/s");
    add_in_range(*drop, "--dt", options->dt, 1e-6, kMostStep, "Length of a step, seconds");
    add_in_range(*drop, "--substep", options->substep, 1e-5, 1.0,
                 "Longest substep; a step is divided into equal ones, seconds");
    add_positive(*drop, "--seconds", options->seconds, "Time simulated, seconds");
    add_in_range(*drop, "--contact-spacing-m", options->contact_spacing_m, 0.0, 1e9,
                 "Bodies touch the coarsest level of at most this spacing, metres; 0: the finest");
    add_in_range(*drop, "--memory-mb", options->memory_mb, 0.001, 0x1p32,
                 "Most memory that chunks take, MB of 2^20 bytes");
    add_count(*drop, "--threads", options->threads, 1,
              "Threads that step the bodies; any number of them gives the same bits", kMostThreads);
    drop->add_flag("--no-sleep", options->no_sleep, "Bodies at rest stay awake");
    drop->add_option(
            "--trace", options->trace,
            "CSV of the pose of every body after every step; step 0 is the start. A file of that "
            "name is replaced")
        ->type_name("FILE");
    drop->add_option("--save", options->save,
                     "Write the world as it is at the end. A file of that name is replaced")
        ->type_name("FILE");
    drop->add_option(
            "--restore", options->restore,
            "Go on from a world that --save wrote over the same terrain: 2 s, and 2 s more "
            "of the world restored, give the bits of 4 s")
        ->type_name("FILE");
    add_record_option(*drop, options->record);
    add_picture_options(*drop, options->film, "film");
    drop->add_flag("--json", options->json, "Print one JSON object");
    add_preset_option(*drop);
    drop->footer(
        "The seed also moves and turns the bodies at the start.\n"
        "Example: terrane drop --dem tools/data/jacksboro.tif --shape mixed --count 100 --speed "
        "300");
    drop->callback([&context, options, drop] {
        context.run = [options, drop] { return run_drop(*options, *drop); };
    });
}

}  // namespace terrane::tools
