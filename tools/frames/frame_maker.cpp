// SPDX-License-Identifier: MIT
#include "frames/frame_maker.h"

#include "program/progress.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <utility>

namespace terrane::tools {
namespace {

// Number of frames without a map after a map that did not pay.
constexpr std::size_t kPause = 32;

// A map pays if it hides at least this number of objects, and this share of those that would otherwise be drawn; the
// smaller share applies if the previous map paid. A map takes as long as choosing the levels of 30,000 objects
// (scene_benchmark --benchmark_filter=horizon); in that time a software rasteriser draws 300 objects.
constexpr std::size_t kLeastHidden = 300;
constexpr double kLeastShare = 0.25, kLeastShareInUse = 0.2;

// Ratio of a map's error limits to the previous frame's errors. Occlusion depends little on this ratio, because the
// errors of the ground are small relative to objects.
constexpr double kErrorMargin = 1.5;

}  // namespace

const HorizonMap* FrameHorizon::begin(const std::shared_ptr<const ResidentSet>& resident,
                                      const View& view) {
    using Clock = std::chrono::steady_clock;
    has_map_ = false;
    ms_ = 0.0;
    if (object_count_ < kLeastHidden) return nullptr;
    if (pause_ > 0) {
        --pause_;
        return nullptr;
    }
    const Clock::time_point start = Clock::now();
    map_.build(resident, view, largest_);
    ms_ = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    has_map_ = true;
    return &map_;
}

// Drops the map of this frame, and makes none in the next kPause frames.
void FrameHorizon::leave_out() {
    has_map_ = has_paid_ = false;
    pause_ = kPause;
}

bool FrameHorizon::pays(const ObjectCounts& culled) {
    if (!has_map_) return true;
    const double least_share = has_paid_ ? kLeastShareInUse : kLeastShare;
    has_paid_ = culled.occluded >= kLeastHidden && culled.occluded_share >= least_share;
    if (!has_paid_) leave_out();
    return has_paid_;
}

bool FrameHorizon::holds_for(const TerrainMesh& mesh, std::optional<bool> is_eye_above) {
    if (!has_map_ || map_.holds_for(mesh, is_eye_above)) return true;
    leave_out();
    return false;
}

void FrameHorizon::end(const TerrainMesh& mesh, const ObjectCounts& counts) {
    follow(mesh);
    object_count_ = counts.drawn + counts.occluded;
}

void FrameHorizon::follow(const TerrainMesh& mesh) {
    largest_ = {.refinable_px = kErrorMargin * mesh.refinable_error_px,
                .finest_m = kErrorMargin * mesh.finest_error_m};
}

FrameMaker::FrameMaker(std::shared_ptr<const HeightSource> source, Pager pager,
                       Triangulator triangulator)
    : source_(std::move(source)),
      pager_(std::move(pager)),
      triangulator_(std::move(triangulator)) {}

Result<FrameMaker> FrameMaker::create(std::shared_ptr<const HeightSource> source,
                                      const FrameMakerSettings& settings,
                                      std::unique_ptr<ChunkLoader> loader) {
    TERRANE_TRY(Triangulator triangulator, Triangulator::create(*source, settings.triangulator));
    TERRANE_TRY(Pager pager, loader ? Pager::create(source, settings.pager, std::move(loader))
                                    : Pager::create(source, settings.pager));
    FrameMaker maker(std::move(source), std::move(pager), std::move(triangulator));
    maker.budget_ = settings.triangulator.triangle_budget;
    maker.max_error_px_ = settings.triangulator.max_error_px;
    if (settings.verify) maker.verifier_.emplace(*maker.source_);
    return maker;
}

Result<void> FrameMaker::set_triangulator(const TriangulatorSettings& settings) {
    TERRANE_TRY(Triangulator made, Triangulator::create(*source_, settings));
    if (device_ != nullptr) TERRANE_TRY(device_->change(settings));
    triangulator_ = std::move(made);
    budget_ = settings.triangle_budget;
    max_error_px_ = settings.max_error_px;
    return {};
}

// The demands of objects, and one that reserves the part of the budget that the governor withholds.
std::span<const TriangleDemand> FrameMaker::with_kept_free(
    std::span<const TriangleDemand> of_objects) {
    if (!governor_) return of_objects;
    const std::size_t kept_free = budget_ - std::min(budget_, governor_->budget());
    demands_.assign(of_objects.begin(), of_objects.end());
    demands_.push_back(
        {std::numeric_limits<double>::infinity(), static_cast<std::uint32_t>(kept_free)});
    return demands_;
}

std::span<const TriangleDemand> FrameMaker::begin_frame(const View& view,
                                                        const HorizonMap* horizon_map) {
    if (!objects_) return with_kept_free({});
    const std::span<const TriangleDemand> demands = objects_->begin_frame(view, horizon_map);
    return with_kept_free(horizon_.pays(objects_->counts()) ? demands
                                                            : objects_->begin_again(view));
}

TerrainMesh FrameMaker::update_mesh(const std::shared_ptr<const ResidentSet>& resident,
                                    const View& view, std::span<const TriangleDemand> demands) {
    if (device_ != nullptr) {
        Result<TerrainMesh> made = device_->update(resident, view, demands);
        if (made) return *made;
    }
    return triangulator_.update(resident, view, demands);
}

Result<TerrainMesh> FrameMaker::host_mesh() {
    return mesh_.device != nullptr ? device_->read() : Result<TerrainMesh>(mesh_);
}

// Triangulates a frame with its objects, omitting those hidden by the ground if the map pays and holds for the mesh.
TerrainMesh FrameMaker::triangulate(const View& view) {
    const std::shared_ptr<const ResidentSet> resident = pager_.resident();
    const HorizonMap* const horizon_map =
        objects_ && objects_->can_be_hidden() ? horizon_.begin(resident, view) : nullptr;
    mesh_ = update_mesh(resident, view, begin_frame(view, horizon_map));
    if (!horizon_.has_map()) return mesh_;
    std::optional<bool> is_eye_above;
    if (mesh_.device != nullptr) {
        is_eye_above = device_->is_above_ground(view.eye_world).value_or(false);
    }
    if (horizon_.holds_for(mesh_, is_eye_above)) return mesh_;
    return update_mesh(resident, view, with_kept_free(objects_->begin_again(view)));
}

void FrameMaker::add_frame_time(const FrameRecord& frame) {
    if (!governor_) return;
    // a window's commands are sent before the device is done with them
    const double ms =
        std::max(frame.update_ms + frame.draw_ms.value_or(0.0), frame.gpu_ms.value_or(0.0));
    governor_->add_frame(ms, frame.triangles, frame.threshold_px > frame.max_error_px);
}

void FrameMaker::load_until_stable(const View& view, std::span<const BodyNeed> bodies,
                                   double time) {
    constexpr double kFirstThreshold_px = 4096.0;
    constexpr int kMostRounds = 64;
    threshold_px_ = kFirstThreshold_px;
    std::uint64_t last_epoch = 0;
    if (objects_) objects_->load_all(view);
    for (int round = 0; round < kMostRounds && !is_interrupted(); ++round) {
        const std::array cameras{CameraNeed{.view = view, .threshold_px = threshold_px_}};
        pager_.update(cameras, bodies, time);
        pager_.finish();
        const TerrainMesh mesh = update_mesh(pager_.resident(), view, begin_frame(view, nullptr));
        horizon_.follow(mesh);
        const bool is_settled =
            mesh.threshold_px >= threshold_px_ && mesh.resident->epoch() == last_epoch;
        if (is_settled || pager_.stats().late_chunks > 0) return;
        last_epoch = mesh.resident->epoch();
        threshold_px_ = std::max(mesh.threshold_px, 0.5 * threshold_px_);
    }
}

MadeFrame FrameMaker::make(CameraNeed camera, std::span<const BodyNeed> bodies, double time,
                           std::optional<double> scene_time) {
    using Clock = std::chrono::steady_clock;
    MadeFrame frame;
    const View view = camera.view;
    camera.threshold_px = threshold_px_;
    const Clock::time_point start = Clock::now();
    pager_.update({&camera, 1}, bodies, time);
    if (objects_) objects_->set_time(scene_time.value_or(time));
    frame.mesh = mesh_ = triangulate(view);
    if (objects_) {
        frame.draws = objects_->end_frame(frame.mesh.demand_threshold_px);
        horizon_.end(frame.mesh, objects_->counts());
    }
    const std::chrono::duration<double, std::milli> taken = Clock::now() - start;
    threshold_px_ = frame.mesh.threshold_px;

    FrameRecord& record = frame.record;
    record.time = time;
    record.eye_world = view.eye_world;
    record.triangles = frame.mesh.triangle_count;
    if (objects_) {
        const ObjectCounts& counts = objects_->counts();
        record.has_objects = true;
        record.triangles += counts.triangles;
        record.objects_drawn = counts.drawn;
        record.objects_culled = counts.culled;
        record.objects_left_out = counts.left_out;
        record.objects_occluded = counts.occluded;
        record.object_triangles = counts.triangles;
        record.objects_ms = counts.ms + horizon_.ms();
    }
    for (const MeshSolid& solid : frame.mesh.solids) {
        record.solid_triangles += solid.triangle_count();
    }
    record.budget = governor_ ? std::min(budget_, governor_->budget()) : budget_;
    record.error_px = frame.mesh.error_px;
    record.max_error_px = max_error_px_;
    record.threshold_px = frame.mesh.threshold_px;
    record.status = frame.mesh.status;
    record.is_from_device = frame.mesh.device != nullptr;
    if (record.is_from_device) record.add_gpu_ms(device_->gpu_ms());
    record.update_ms = taken.count();
    record.paging = pager_.stats();
    if (verifier_) {
        const Result<TerrainMesh> mesh = host_mesh();
        Measurement measured;
        measured.holes = 1;  // of a mesh that cannot be read
        if (mesh) measured = verifier_->measure(*mesh, view);
        record.measured_error_px = measured.error_px;
        record.max_pop_px = measured.max_pop_px;
        record.max_pop_elsewhere_px = measured.max_pop_elsewhere_px;
        record.points = measured.points;
        record.holes = measured.holes;
        record.max_solid_pop_px = measured.max_solid_pop_px;
    }
    return frame;
}

}  // namespace terrane::tools
