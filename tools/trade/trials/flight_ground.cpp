// SPDX-License-Identifier: MIT
#include "trade/trials/flight_ground.h"

#include "flight/flight_options.h"
#include "frames/frame_maker.h"
#include "frames/verify.h"
#include "output/interrupt.h"
#include "trade/table/thread_clock.h"

#include <terrane/playback/camera_path.h>

#include <algorithm>
#include <chrono>
#include <limits>

namespace terrane::tools {
namespace {

constexpr double kFlightSeconds = 10.0;
// Nearer to the ground the error is that of the finest spacing, whatever the settings.
constexpr double kLeastAltitude = 150.0, kAltitudeInSpacings = 40.0;
constexpr double kFrame_s = 1.0 / 30.0;
// Of the finest settings that a dial has: what is loaded.
constexpr std::size_t kMostBudget = 1'000'000, kMostQuickBudget = 300'000;
constexpr double kLeastError_px = 0.5;

double elapsed_ms(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

}  // namespace

CommandResult<std::shared_ptr<FlightGround>> FlightGround::create(const TradePlace& place) {
    const HeightSource& source = *place.terrain->source;
    const double altitude =
        std::max(kLeastAltitude, kAltitudeInSpacings * source.lattice().spacing);
    const Result<CameraPath> path = CameraPath::create(
        "straight", source, {.speed = 100.0, .altitude = altitude, .seconds = kFlightSeconds});
    if (!path) return pass_on(path.error());
    FrameMakerSettings settings;
    settings.pager.memory_bytes = std::size_t{2} << 30U;
    settings.pager.worker_count = 0;
    settings.triangulator.triangle_budget = place.is_quick ? kMostQuickBudget : kMostBudget;
    settings.triangulator.max_error_px = kLeastError_px;
    Result<FrameMaker> maker = FrameMaker::create(place.terrain->source, settings);
    if (!maker) return pass_on(maker.error());
    std::shared_ptr<FlightGround> ground(new FlightGround(place.terrain->source));
    const View picture = make_view({}, 60.0);
    const int moment_count = place.is_quick ? 2 : 6;
    for (int i = 0; i < moment_count; ++i) {
        if (is_interrupted()) return failure("interrupted before the tables were whole");
        const double time = kFlightSeconds * i / moment_count;
        Moment moment{.view = view_at(picture, path->at(time)),
                      .next = view_at(picture, path->at(time + kFrame_s)),
                      .resident = nullptr};
        maker->load_until_stable(moment.view, {}, time);
        moment.resident = maker->pager().resident();
        ground->moments_.push_back(std::move(moment));
    }
    ground->verified_moments_ = place.is_quick ? 1 : 2;
    ground->open_device(place.is_quick);
    return ground;
}

void FlightGround::open_device(bool is_quick) {
    Result<EglContext> context = EglContext::create();
    // a software rasteriser takes seconds for the largest meshes
    if (!context || (is_quick && context->is_software())) return;
    RendererSettings settings;
    if (context->is_software()) settings.sample_count = 1;
    const View& view = moments_.front().view;
    Result<TerrainRenderer> renderer =
        TerrainRenderer::create(*context, view.width_px, view.height_px, settings);
    if (!renderer) return;
    device_ = std::make_unique<Device>(Device{std::move(*context), std::move(*renderer)});
}

Result<double> FlightGround::draw(const TerrainMesh& mesh, const View& view) {
    if (device_ == nullptr) return std::numeric_limits<double>::quiet_NaN();
    device_->context.make_current();
    const auto start = std::chrono::steady_clock::now();
    const Result<void> drawn = device_->renderer.draw(mesh, view);
    if (!drawn) return tl::unexpected(drawn.error());
    device_->renderer.read();
    return elapsed_ms(start);
}

Result<FlightFigures> FlightGround::fly(const TriangulatorSettings& settings) {
    Result<Triangulator> triangulator = Triangulator::create(*source_, settings);
    if (!triangulator) return tl::unexpected(triangulator.error());
    FlightFigures figures;
    std::vector<double> update_ms;
    for (const Moment& moment : moments_) {
        for (const View& view : {moment.view, moment.next}) {
            const double start = thread_seconds();
            const TerrainMesh mesh = triangulator->update(moment.resident, view);
            update_ms.push_back(1e3 * (thread_seconds() - start));
            figures.error_px = std::max(figures.error_px, mesh.error_px);
            figures.triangles += static_cast<double>(mesh.triangle_count);
            if (update_ms.size() != 1) continue;
            const Result<double> draw_ms = draw(mesh, view);
            if (!draw_ms) return tl::unexpected(draw_ms.error());
            figures.draw_ms = *draw_ms;
        }
    }
    figures.triangles /= static_cast<double>(update_ms.size());
    figures.update_ms = percentile(update_ms, 0.5);
    return figures;
}

Result<FlightTruth> FlightGround::verify(const TriangulatorSettings& settings) const {
    constexpr std::size_t kPoints = 20'000;
    Result<Triangulator> triangulator = Triangulator::create(*source_, settings);
    if (!triangulator) return tl::unexpected(triangulator.error());
    FlightTruth truth;
    for (std::size_t i = 0; i < verified_moments_; ++i) {
        const Moment& moment = moments_[i];
        Verifier verifier(*source_, kPoints);
        for (const View& view : {moment.view, moment.next}) {
            const TerrainMesh mesh = triangulator->update(moment.resident, view);
            const Measurement measured = verifier.measure(mesh, view);
            truth.error_px = std::max(truth.error_px, measured.error_px);
            truth.max_pop_px =
                std::max({truth.max_pop_px, measured.max_pop_px, measured.max_pop_elsewhere_px});
        }
    }
    return truth;
}

}  // namespace terrane::tools
