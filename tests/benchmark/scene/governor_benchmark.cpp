// SPDX-License-Identifier: MIT
// FrameGovernor on real draws: a camera that looks at nothing turns to a crowd of rocks, and away again. The target is
// four times the frame without rocks. Prints how far frames are from the target once they have settled, and for how
// many frames the crowd exceeds it; beside it frames of the last budget without a governor, for how much times vary.
//
//   governor_benchmark [--quick]
#include "benchmark/scene/device.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/scene/frame_governor.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/simplify.h>

#include <algorithm>
#include <vector>

namespace terrane::bench {
namespace {

constexpr int kWidth = 320, kHeight = 180;
constexpr std::size_t kMostTriangles = 4'000'000;

struct Crowd {
    TerrainRenderer renderer;
    Scene scene;
};

Crowd make_crowd(GlContext& context, int count) {
    Crowd crowd = {make_renderer(context, kWidth, kHeight), Scene::create({}).value()};
    const TriangleMesh mesh = test::make_rock(2, 1);
    ObjectModel model;
    model.bounds = {Eigen::Vector3d::Constant(-1.5), Eigen::Vector3d::Constant(1.5)};
    const std::vector<SimplifiedMesh> levels =
        simplify(
            {.vertices = mesh.positions, .triangles = mesh.triangles},
            std::vector<SimplifyLevel>{{.error_m = 0.01}, {.error_m = 0.04}, {.error_m = 0.16}})
            .value();
    std::vector<MeshLevel> triangles = {{.triangles = mesh.triangles}};
    model.levels.push_back({0.0, static_cast<std::uint32_t>(mesh.triangles.size()), 0, false});
    for (std::uint32_t i = 0; i < levels.size(); ++i) {
        triangles.push_back({.triangles = levels[i].triangles});
        model.levels.push_back({0.01 * static_cast<double>(1u << (2 * i)),
                                static_cast<std::uint32_t>(levels[i].triangles.size()), i + 1,
                                false});
    }
    model.absence_error_m = 2.0;
    model.mesh = crowd.renderer.add_mesh(mesh, triangles).value();
    test::Random random(3);
    std::vector<PlacedObject> objects(static_cast<std::size_t>(count));
    for (PlacedObject& object : objects) {
        // north of the camera
        const double x = random.between(-60.0, 60.0), y = random.between(30.0, 200.0);
        object.position = {x, y, random.between(-30.0, 30.0)};
    }
    const ModelId rock = crowd.scene.add_model(model).value();
    value_or_exit(crowd.scene.add(crowd.scene.root(), {}, InstancesNode{rock, objects}));
    return crowd;
}

struct Frame {
    double ms = 0.0;
    std::size_t triangles = 0;
    bool wants_more = false;
};

Frame draw(Crowd& crowd, bool sees_crowd, std::size_t budget) {
    const WorldPos target(0.0, sees_crowd ? 100.0 : -100.0, 0.0);
    const View view = look_at(WorldPos::Zero(), target, 0.9, kWidth, kHeight).value();
    const Stopwatch watch(Clock::wall);
    // as a triangulator would: the smallest threshold whose triangles fit
    double threshold_px = 0.01;
    std::size_t granted = 0;
    bool wants_more = false;
    for (const TriangleDemand& demand : crowd.scene.begin_frame(view)) {
        if (granted + demand.triangles > budget) {
            threshold_px = demand.threshold_px;
            wants_more = true;
            break;
        }
        granted += demand.triangles;
    }
    draw_objects(crowd.renderer, view, crowd.scene.end_frame(threshold_px));
    return {watch.ms(), crowd.scene.counts().triangles, wants_more};
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane;
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "governor_benchmark [--quick]");
    const bool is_quick = arguments.has("--quick");
    arguments.finish();
    GlContext context = open_device();
    Crowd crowd = make_crowd(context, is_quick ? 200 : 4000);
    std::vector<double> empty;
    for (int i = 0; i < 15; ++i) empty.push_back(draw(crowd, false, kMostTriangles).ms);
    const double target_ms = 4.0 * median(empty);
    const Frame whole = draw(crowd, true, kMostTriangles);
    std::printf(
        "without rocks %.2f ms, target %.2f ms; all rocks without a governor: %zu triangles, %.2f "
        "ms\n",
        median(empty), target_ms, whole.triangles, whole.ms);
    FrameGovernor governor =
        FrameGovernor::create({.frame_ms = target_ms, .most_budget = kMostTriangles},
                              kMostTriangles)
            .value();
    const int frames = is_quick ? 20 : 90;
    for (int turn = 1; turn <= 3; ++turn) {
        for (const bool sees_crowd : {false, true}) {
            std::vector<double> settled;
            double most = 0.0;
            int last_over = 0;
            for (int i = 1; i <= frames; ++i) {
                const Frame frame = draw(crowd, sees_crowd, governor.budget());
                governor.add_frame(frame.ms, frame.triangles, frame.wants_more);
                most = std::max(most, frame.ms);
                if (frame.ms > 1.1 * target_ms && i <= 30) last_over = i;
                if (i > 30 || is_quick) settled.push_back(frame.ms / target_ms);
            }
            std::printf(
                "turn %d, %-9s first frames up to %.2f of the target, the last one over by 10 %% "
                "is %d; "
                "after 30 frames median %.2f, 10 %% to 90 %%: %.2f to %.2f; budget %zu\n",
                turn, sees_crowd ? "to rocks:" : "away:", most / target_ms, last_over,
                median(settled), quantile(settled, 0.1), quantile(settled, 0.9), governor.budget());
        }
    }
    const std::size_t last_budget = governor.budget();
    std::vector<double> fixed;
    for (int i = 0; i < frames; ++i) fixed.push_back(draw(crowd, true, last_budget).ms / target_ms);
    std::printf("fixed budget of %zu: median %.2f, 10 %% to 90 %%: %.2f to %.2f\n", last_budget,
                median(fixed), quantile(fixed, 0.1), quantile(fixed, 0.9));
    return 0;
}
