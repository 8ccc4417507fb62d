// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "frames/frame_maker.h"
#include "frames/verification.h"
#include "lab/dial.h"
#include "lab/ground_trials.h"
#include "program/options.h"
#include "program/progress.h"

#include <terrane/playback/camera_path.h>
#include <terrane/render/gpu_triangulator.h>
#include <terrane/render/terrain_renderer.h>

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kFlightSeconds = 10.0;
// Least altitude, in metres and in finest spacings: below it the finest spacing determines the error.
constexpr double kLeastAltitude = 150.0, kAltitudeInSpacings = 40.0;
constexpr double kFrame_s = 1.0 / 30.0;
// The finest settings among all dials, which determine the chunks to load.
constexpr std::size_t kMostBudget = 1'000'000, kMostQuickBudget = 300'000;
constexpr double kLeastError_px = 0.5;

const std::vector<TradeColumn> kPixelColumns{
    {"update_ms", "update of the mesh", "ms"},
    {"draw_ms", "drawing until the picture can be read", "ms"},
    {"error_px", "certified screen error", "px"},
    {"measured_error_px", "screen error by brute force", "px"},
    {"max_pop_px", "movement between frames", "px"},
    {"triangles", "triangles"}};

/// Verifier's measurements of a flight; the same in every run.
struct FlightTruth {
    double error_px = 0.0;    ///< largest error by brute force
    double max_pop_px = 0.0;  ///< largest movement from a frame to the next
};

/// What makes the meshes of a flight.
struct MeshMaker {
    std::function<Result<TerrainMesh>(const std::shared_ptr<const ResidentSet>&, const View&)> make;
    std::function<Result<TerrainMesh>()> read =
        {};                       ///< the last mesh, in memory; empty if it always is
    Clock clock = Clock::thread;  ///< of its time
};

/// Fails for settings that Triangulator::create() refuses.
Result<MeshMaker> mesh_maker(const HeightSource& source, const TriangulatorSettings& settings) {
    TERRANE_TRY(Triangulator made, Triangulator::create(source, settings));
    const auto shared = std::make_shared<Triangulator>(std::move(made));
    return MeshMaker{
        .make = [shared](const auto& resident, const View& view) -> Result<TerrainMesh> {
            return shared->update(resident, view);
        }};
}

/// Moments of a flight over a terrain, each with two consecutive frames. All chunks that the finest settings of the
/// dials can draw are resident, so that paging does not affect the measurements.
class FlightGround {
public:
    /// Loads the chunks, which takes seconds.
    ///
    /// Fails: as CameraPath, FrameMaker
    static CommandResult<std::shared_ptr<FlightGround>> create(const TradePlace& place) {
        const HeightSource& source = *place.terrain->source;
        const double altitude =
            std::max(kLeastAltitude, kAltitudeInSpacings * source.lattice().spacing);
        TERRANE_TRY(
            const CameraPath path,
            CameraPath::create("straight", source,
                               {.speed = 100.0, .altitude = altitude, .seconds = kFlightSeconds}));
        FrameMakerSettings settings;
        settings.pager.memory_bytes = std::size_t{2} << 30U;
        settings.pager.worker_count = 0;
        settings.triangulator.triangle_budget = place.is_quick ? kMostQuickBudget : kMostBudget;
        settings.triangulator.max_error_px = kLeastError_px;
        TERRANE_TRY(FrameMaker maker, FrameMaker::create(place.terrain->source, settings));
        std::shared_ptr<FlightGround> ground(new FlightGround(place.terrain->source));
        const View picture = make_view({}, 60.0);
        const int moment_count = place.is_quick ? 2 : 6;
        for (int i = 0; i < moment_count; ++i) {
            if (is_interrupted()) return failure("interrupted before the tables were whole");
            const double time = kFlightSeconds * i / moment_count;
            Moment moment{.view = view_at(picture, path.at(time)),
                          .next = view_at(picture, path.at(time + kFrame_s)),
                          .resident = nullptr};
            maker.load_until_stable(moment.view, {}, time);
            moment.resident = maker.pager().resident();
            ground->moments_.push_back(std::move(moment));
        }
        ground->verified_moments_ = place.is_quick ? 1 : 2;
        ground->open_device(place.is_quick);
        return ground;
    }

    /// Measures the frames of the first moments. Fails as `maker`.
    Result<FlightTruth> verify(const MeshMaker& maker) const {
        constexpr std::size_t kPoints = 20'000;
        FlightTruth truth;
        for (std::size_t i = 0; i < verified_moments_; ++i) {
            const Moment& moment = moments_[i];
            Verifier verifier(*source_, kPoints);
            for (const View& view : {moment.view, moment.next}) {
                TERRANE_TRY(TerrainMesh mesh, maker.make(moment.resident, view));
                if (maker.read) {
                    TERRANE_TRY(mesh, maker.read());
                }
                const Measurement measured = verifier.measure(mesh, view);
                truth.error_px = std::max(truth.error_px, measured.error_px);
                truth.max_pop_px = std::max(
                    {truth.max_pop_px, measured.max_pop_px, measured.max_pop_elsewhere_px});
            }
        }
        return truth;
    }

    /// Makes all frames, and draws the first one. Returns the values of kPixelColumns.
    Result<TradeSample> fly(const MeshMaker& maker, const FlightTruth& truth) {
        std::vector<double> update_ms;
        double draw_ms = 0.0, error_px = 0.0, triangles = 0.0;
        for (const Moment& moment : moments_) {
            for (const View& view : {moment.view, moment.next}) {
                const Stopwatch watch(maker.clock);
                TERRANE_TRY(const TerrainMesh mesh, maker.make(moment.resident, view));
                update_ms.push_back(watch.ms());
                error_px = std::max(error_px, mesh.error_px);
                triangles += static_cast<double>(mesh.triangle_count);
                if (update_ms.size() != 1) continue;
                TERRANE_TRY(const double drawn, draw(mesh, view));
                draw_ms = drawn;
            }
        }
        return TradeSample{percentile(update_ms, 0.5),
                           draw_ms,
                           error_px,
                           truth.error_px,
                           truth.max_pop_px,
                           triangles / static_cast<double>(update_ms.size())};
    }

    /// Makes the meshes on the device; none without a device that can. Valid while the ground is.
    std::optional<MeshMaker> device_mesh_maker(const TriangulatorSettings& settings) {
        if (device_ == nullptr) return {};
        device_->context.make_current();
        Result<GpuTriangulator> made =
            GpuTriangulator::create(device_->context, *source_, settings);
        if (!made) return {};
        const auto shared = std::make_shared<GpuTriangulator>(*std::move(made));
        return MeshMaker{
            .make =
                [shared, device = device_.get()](const auto& resident, const View& view) {
                    device->context.make_current();
                    return shared->update(resident, view);
                },
            .read = [shared] { return shared->read(); },
            .clock = Clock::wall};
    }

private:
    struct Moment {
        View view, next;  ///< 1/30 s apart
        std::shared_ptr<const ResidentSet> resident;
    };
    struct Device {
        GlContext context;  // the renderer's objects live in it
        TerrainRenderer renderer;
    };

    explicit FlightGround(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)) {}

    void open_device(bool is_quick) {
        Result<GlContext> context = GlContext::create();
        if (!context) return;
        // a software rasteriser takes seconds for the largest meshes
        draws_ = !is_quick || !context->is_software();
        RendererSettings settings;
        if (context->is_software()) settings.sample_count = 1;
        const View& view = moments_.front().view;
        Result<TerrainRenderer> renderer =
            TerrainRenderer::create(*context, view.width_px, view.height_px, settings);
        if (!renderer) return;
        device_ = std::make_unique<Device>(Device{std::move(*context), std::move(*renderer)});
    }

    // Draws a mesh. Returns the milliseconds until the picture can be read; NaN without a device.
    Result<double> draw(const TerrainMesh& mesh, const View& view) {
        if (device_ == nullptr || !draws_) return std::numeric_limits<double>::quiet_NaN();
        device_->context.make_current();
        const Stopwatch watch(Clock::wall);
        TERRANE_TRY(device_->renderer.draw(mesh, view));
        device_->renderer.read();
        return watch.ms();
    }

    std::shared_ptr<const HeightSource> source_;
    std::vector<Moment> moments_;
    std::size_t verified_moments_ = 1;
    std::unique_ptr<Device> device_;  // null if none can be opened
    bool draws_ = false;
};

/// The flights over each terrain, shared by all pixel dials.
using FlightGrounds = std::map<const Terrain*, std::shared_ptr<FlightGround>>;

CommandResult<std::shared_ptr<FlightGround>> find_flight_ground(FlightGrounds& grounds,
                                                                const TradePlace& place) {
    std::shared_ptr<FlightGround>& known = grounds[place.terrain];
    if (known != nullptr) return known;
    CommandResult<std::shared_ptr<FlightGround>> made = FlightGround::create(place);
    if (made) known = *made;
    return made;
}

TradeTrial flight_trial(std::string label, const MeshMaker& maker,
                        const std::shared_ptr<FlightGround>& ground,
                        std::optional<double> value = {}) {
    const auto measure =
        [maker, ground,
         truth = std::make_shared<std::optional<FlightTruth>>()]() -> CommandResult<TradeSample> {
        if (!*truth) {
            TERRANE_TRY(const FlightTruth verified, ground->verify(maker));
            *truth = verified;
        }
        TERRANE_TRY(const TradeSample sample, ground->fly(maker, **truth));
        return sample;
    };
    return {std::move(label), measure, value};
}

Dial pixel_dial(const std::shared_ptr<FlightGrounds>& grounds, Dial dial,
                const FieldValues<TriangulatorSettings>& values) {
    dial.columns = kPixelColumns;
    dial.cost = "update_ms";
    dial.prepare = [grounds, values](const TradePlace& place) -> TradeTrials {
        TERRANE_TRY(const auto ground, find_flight_ground(*grounds, place));
        const TriangulatorSettings fixed{.triangle_budget = 1'000'000};
        return make_trials(
            values, fixed, place.is_quick,
            [&](double value, const TriangulatorSettings& settings) -> CommandResult<TradeTrial> {
                TERRANE_TRY(const MeshMaker maker, mesh_maker(*place.terrain->source, settings));
                return flight_trial(fmt::format("{:.6g}", value), maker, ground, value);
            });
    };
    return dial;
}

/// Settings of a flight from a preset's flags.
TriangulatorSettings triangulator_of(const Preset& preset) {
    const auto value = [&preset](const char* flag) { return preset_value(preset, flag).value(); };
    return {.triangle_budget = static_cast<std::size_t>(value("--budget")),
            .max_error_px = value("--max-error-px")};
}

TradeTrials prepare_presets(FlightGrounds& grounds, const TradePlace& place) {
    TERRANE_TRY(const auto flight, find_flight_ground(grounds, place));
    TERRANE_TRY(const Ground ground, load_contact_ground(*place.terrain, 0.0));
    const std::vector known(presets().begin(), presets().end());
    return make_trials(known, [&](const Preset& preset) -> CommandResult<TradeTrial> {
        const DropTrial drop{.count = place.is_quick ? std::size_t{40} : std::size_t{200},
                             .seconds = 1.0,
                             .dt = preset_value(preset, "--dt").value(),
                             .world = {.max_substep = preset_value(preset, "--substep").value(),
                                       .collide_bodies = false}};
        TERRANE_TRY(const MeshMaker maker,
                    mesh_maker(*place.terrain->source, triangulator_of(preset)));
        TradeTrial trial = flight_trial(std::string(preset.name), maker, flight);
        trial.measure = [fly = trial.measure, drop, ground]() -> CommandResult<TradeSample> {
            TERRANE_TRY(TradeSample sample, fly());
            TERRANE_TRY(const DropFigures dropped, run_drop_trial(drop, ground));
            sample.insert(sample.end(), {dropped.ms, dropped.max_depth_m, dropped.drift});
            return sample;
        };
        return trial;
    });
}

std::vector<std::string> compare_presets(const TradeTable& table) {
    const auto times = [&table](const char* key) {
        const std::size_t column = column_index(table.dial, key);
        return ratio_or_zero(table.rows.back().figures[column].median,
                             table.rows.front().figures[column].median);
    };
    return {
        fmt::format("accurate takes {:.3g} times the time of fast in the flight's updates, and "
                    "{:.3g} times in the drop.",
                    times("update_ms"), times("drop_ms"))};
}

Dial preset_dial(const std::shared_ptr<FlightGrounds>& grounds) {
    Dial dial{
        .key = "preset",
        .title = "Presets",
        .text = "The flight, and a drop of spheres of radius 0.5 m, with the flags of each preset.",
        .columns = kPixelColumns,
        .cost = "update_ms",
        .loss = "error_px",
        .prepare = [grounds](const TradePlace& place) { return prepare_presets(*grounds, place); },
        .find = compare_presets};
    dial.columns.push_back({"drop_ms", "drop, a simulated second", "ms"});
    dial.columns.push_back({"max_depth_m", "penetration", "m"});
    dial.columns.push_back({"drift", "energy gained over lost", "share"});
    return dial;
}

// The triangles of one budget from the CPU and, if there is a device, from the device.
TradeTrials prepare_triangulators(FlightGrounds& grounds, const TradePlace& place) {
    TERRANE_TRY(const auto flight, find_flight_ground(grounds, place));
    const TriangulatorSettings settings{.triangle_budget = 100'000, .max_error_px = 0.01};
    const HeightSource& source = *place.terrain->source;
    TERRANE_TRY(const MeshMaker of_cpu, mesh_maker(source, settings));
    std::vector<TradeTrial> trials{flight_trial("cpu", of_cpu, flight)};
    if (const auto of_device = flight->device_mesh_maker(settings))
        trials.push_back(flight_trial("gpu", *of_device, flight));
    return trials;
}

std::vector<std::string> compare_triangulators(const TradeTable& table) {
    if (table.rows.size() < 2) return {"No device makes the triangles here."};
    const std::size_t column = column_index(table.dial, "update_ms");
    return {fmt::format("The same triangles take the device {:.3g} times the time of the CPU.",
                        ratio_or_zero(table.rows.back().figures[column].median,
                                      table.rows.front().figures[column].median))};
}

}  // namespace

std::vector<Dial> pixel_dials() {
    const auto grounds = std::make_shared<FlightGrounds>();
    return {
        pixel_dial(grounds,
                   {.key = "budget",
                    .title = "Triangle budget",
                    .axis = "triangles",
                    .text = "Flight at 100 m/s, 150 m or 40 spacings of the data above the "
                            "ground, whichever is more; 1280 x 720; no target but 0.01 px.",
                    .preset_flag = "--budget",
                    .loss = "error_px"},
                   {.all = {3000, 10'000, 30'000, 100'000, 200'000, 300'000, 500'000, 1'000'000},
                    .quick = {10'000, 30'000, 100'000, 300'000},
                    .set =
                        [](double v, TriangulatorSettings& s) {
                            s.triangle_budget = static_cast<std::size_t>(v);
                            s.max_error_px = 0.01;
                        }}),
        pixel_dial(grounds,
                   {.key = "target",
                    .title = "Target of the screen error",
                    .axis = "px",
                    .text = "The same flight; at most 1,000,000 triangles.",
                    .preset_flag = "--max-error-px",
                    .loss = "error_px"},
                   {.all = {16, 8, 4, 2, 1, 0.7, 0.5},
                    .quick = {8, 4, 2, 1},
                    .set = [](double v, TriangulatorSettings& s) { s.max_error_px = v; }}),
        pixel_dial(grounds,
                   {.key = "morph-ratio",
                    .title = "Morph ratio",
                    .axis = "morph_ratio",
                    .text = "The same flight; target 2 px. Vertices move between frames instead "
                            "of jumping, for more triangles.",
                    .loss = "max_pop_px"},
                   {.all = {1, 1.1, 1.2, 1.3, 1.5, 2, 3, 4},
                    .quick = {1, 1.1, 1.3, 2},
                    .set =
                        [](double v, TriangulatorSettings& s) {
                            s.max_error_px = 2.0;
                            s.morph_ratio = v;
                        }}),
        {.key = "triangulator",
         .title = "What makes the triangles",
         .text =
             "The same flight; 100,000 triangles. The time of the CPU is that of its thread, the "
             "time of the device is that of the frame.",
         .columns = kPixelColumns,
         .cost = "update_ms",
         .loss = "error_px",
         .prepare =
             [grounds](const TradePlace& place) { return prepare_triangulators(*grounds, place); },
         .find = compare_triangulators},
        preset_dial(grounds)};
}

}  // namespace terrane::tools
