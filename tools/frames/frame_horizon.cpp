// SPDX-License-Identifier: MIT
#include "frames/frame_horizon.h"

#include <chrono>

namespace terrane::tools {
namespace {

// Frames without a map after one that did not pay.
constexpr std::size_t kPause = 32;

// Least number of objects that are hidden, and their share of those that would be drawn, for a map to pay; the smaller
// share is for one that is in use. A map takes as long as the levels of 30,000 objects (scene_benchmark
// --benchmark_filter=horizon), and a software rasteriser draws 300 in that time.
constexpr std::size_t kLeastHidden = 300;
constexpr double kLeastShare = 0.25, kLeastShareInUse = 0.2;

// Limits of a frame's errors over those of the frame before. What is hidden depends little on them: errors near the
// ground are small against objects.
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

// The rest of the frame, and the next ones, have no map.
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

bool FrameHorizon::holds_for(const TerrainMesh& mesh) {
    if (!has_map_ || map_.holds_for(mesh)) return true;
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

}  // namespace terrane::tools
