// SPDX-License-Identifier: MIT
// Near objects of many triangles with discrete and with continuous levels of detail, at equal screen error: triangles,
// processor time of a frame (all threads, a software rasteriser among them) and of its levels alone. The eye comes
// nearer by a thousandth a frame. Frames of the two alternate; medians.
//
//   dense_object_benchmark [--quick] [--pictures FOLDER]
#include "benchmark/scene/device.h"
#include "support/meshes.h"

#include <terrane/render/upload_levels.h>
#include <terrane/scene/object_levels.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/progressive_mesh.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane::bench {
namespace {

constexpr int kWidth = 1280, kHeight = 720;
constexpr double kErrorPx = 1.0;

struct Dense {
    TerrainRenderer renderer;
    Scene discrete, continuous;
    double radius = 0.0;  // of the bounding sphere
};

Scene scene_of(const ObjectModel& model) {
    Scene scene = Scene::create({}).value();
    const ModelId id = scene.add_model(model).value();
    value_or_exit(scene.add(scene.root(), {}, ModelNode{.model = id}));
    return scene;
}

Dense make_dense(GlContext& context, int depth) {
    const TriangleMesh mesh = test::make_rock(depth, 1);
    ObjectLevels levels = make_object_levels(mesh).value();
    TerrainRenderer renderer = make_renderer(context, kWidth, kHeight);
    value_or_exit(upload_levels(levels, {}, renderer));
    levels.model.continuous = nullptr;
    Scene discrete = scene_of(levels.model);
    levels.model.continuous =
        std::make_shared<const ProgressiveMesh>(ProgressiveMesh::create(mesh).value());
    Scene continuous = scene_of(levels.model);
    const double radius = 0.5 * (levels.model.bounds.high - levels.model.bounds.low).norm();
    return {std::move(renderer), std::move(discrete), std::move(continuous), radius};
}

// Frames of one of the two scenes.
struct Frames {
    std::vector<double> frame_ms, levels_ms, triangles;

    void draw(Dense& dense, Scene& scene, const View& view) {
        const double start = processor_ms();
        scene.begin_frame(view, kErrorPx);
        const SceneDraws draws = scene.end_frame(kErrorPx);
        levels_ms.push_back(processor_ms() - start);
        draw_objects(dense.renderer, view, draws);
        frame_ms.push_back(processor_ms() - start);
        triangles.push_back(static_cast<double>(scene.counts().triangles));
    }
};

void compare(Dense& dense, double distance, int frames, const std::string& pictures) {
    Frames of_discrete, of_continuous;
    const Eigen::Vector3d direction = Eigen::Vector3d(0.8, -0.5, 0.3).normalized();
    for (int i = 0; i < frames; ++i, distance *= 0.999) {
        const WorldPos eye = (distance + dense.radius) * direction;
        const View view = look_at(eye, WorldPos::Zero(), 1.0, kWidth, kHeight).value();
        const bool is_kept = i == 0 && !pictures.empty();
        of_discrete.draw(dense, dense.discrete, view);
        if (is_kept) value_or_exit(write_png(dense.renderer.read(), pictures + "_d.png"));
        of_continuous.draw(dense, dense.continuous, view);
        if (is_kept) value_or_exit(write_png(dense.renderer.read(), pictures + "_c.png"));
    }
    std::printf("  %7.2f m: %6.0f, %6.0f triangles; %6.1f, %6.1f ms; levels alone %.3f, %.3f ms\n",
                distance, median(of_discrete.triangles), median(of_continuous.triangles),
                median(of_discrete.frame_ms), median(of_continuous.frame_ms),
                median(of_discrete.levels_ms), median(of_continuous.levels_ms));
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "dense_object_benchmark [--quick] [--pictures FOLDER]");
    const bool is_quick = arguments.has("--quick");
    const std::string pictures = arguments.text("--pictures", "");
    arguments.finish();
    terrane::GlContext context = open_device();
    std::printf("a rock, discrete levels and continuous ones within %.0f px, %d x %d\n", kErrorPx,
                kWidth, kHeight);
    for (int depth = 3; depth <= (is_quick ? 3 : 6); ++depth) {
        Dense dense = make_dense(context, depth);
        std::printf("%d triangles:\n", 20 << (2 * depth));
        for (double distance = 16.0; distance >= 0.2; distance *= is_quick ? 0.1 : 0.25) {
            char name[64] = "";
            std::snprintf(name, sizeof(name), "/rock%d_%05.2f", depth, distance);
            compare(dense, distance, is_quick ? 3 : 11,
                    pictures.empty() ? std::string() : pictures + name);
        }
    }
    return 0;
}
