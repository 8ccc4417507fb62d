// SPDX-License-Identifier: MIT
// How much of an object's picture its changes of level change, from frame to frame of a slow approach.
#include "frames/object_field.h"
#include "scene/mesh_files.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace terrane::tools {
namespace slow_approach_test {

constexpr int kSide = 128;
constexpr double kStep = 0.999;   // of the distance, a frame
constexpr double kApart = 0.995;  // of the distances that are compared with their next ones
constexpr double kFov = 0.9;

// Pixels of which a channel differs by more than `more_than` levels.
int count_different(const Image& a, const Image& b, int more_than) {
    int count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        int apart = 0;
        for (std::size_t k = i; k < i + 3; ++k)
            apart = std::max(apart, std::abs(int{a.rgb[k]} - int{b.rgb[k]}));
        count += apart > more_than ? 1 : 0;
    }
    return count;
}

class SlowApproach : public ::testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        Result<EglContext> context = EglContext::create();
        if (!context) GTEST_SKIP() << context.error().message;
        context_.emplace(*std::move(context));
    }
    Image draw(TerrainRenderer& renderer, const View& view, const SceneDraws& draws) {
        EXPECT_TRUE(renderer.draw({}, view, {}, draws));
        return renderer.read();
    }
    // The finest level alone.
    Image draw_finest(TerrainRenderer& renderer, const View& view, MeshId mesh) {
        ObjectInstance instance;
        const LocalVec offset = to_local(WorldPos::Zero(), view.eye_world);
        instance.offset_eye = {offset.x(), offset.y(), offset.z()};
        const MeshDraw finest = {mesh, 0, 0, 1};
        return draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&finest, 1}});
    }
    static View view_from(const WorldPos& middle, double distance) {
        const WorldPos eye = middle + distance * Eigen::Vector3d(0.8, 0.59, 0.1).normalized();
        return look_at(eye, middle, kFov, kSide, kSide).value();
    }
    std::optional<EglContext> context_;
};

// Prints the largest share of the object's pixels that change from a frame to the next: by its levels alone, by
// levels and motion, and by the motion of the finest mesh. Outlines that move change pixels too.
TEST_P(SlowApproach, LevelsChangeAFewPixelsAFrame) {
    const std::string file = std::string(TERRANE_SOURCE_DIR "/tools/data/") + GetParam();
    const TriangleMesh mesh = read_mesh(file).value();
    ObjectLevels levels = make_levels(mesh).value();
    TerrainRenderer renderer = TerrainRenderer::create(*context_, kSide, kSide, {}).value();
    levels.model.mesh = renderer.add_mesh(levels.mesh, levels.mesh_levels()).value();
    if (levels.model.impostor)
        levels.model.impostor = renderer.add_impostor(levels.model.mesh).value();
    const SceneSettings settings;
    Scene scene = Scene::create(settings).value();
    const ModelId model = scene.add_model(levels.model).value();
    const PlacedObject placed;
    ASSERT_TRUE(scene.add_group(model, {&placed, 1}));
    const WorldPos middle = 0.5 * (levels.model.bounds.low + levels.model.bounds.high);
    const double radius = 0.5 * (levels.model.bounds.high - levels.model.bounds.low).norm();
    for (std::size_t level = 1; level < levels.model.levels.size(); ++level) {
        // screen errors use the distance from the bounding sphere
        const double pixels = 0.5 * kSide / std::tan(0.5 * kFov);
        const double near = levels.model.levels[level].error_m * pixels;
        double worst_of_levels = 0.0, worst = 0.0, worst_alone = 0.0;
        int compared = 0;
        for (double d = 1.05 * settings.fade_ratio * near; d > 0.95 * near; d *= kApart) {
            const View here = view_from(middle, d + radius),
                       next = view_from(middle, kStep * d + radius);
            const double covered = count_different(draw_finest(renderer, here, levels.model.mesh),
                                                   draw(renderer, here, {}), 0);
            scene.begin_frame(here);
            const Image before = draw(renderer, here, scene.end_frame(1.0));
            // the levels of the next frame, from the place of this one
            const Image changed = draw(renderer, here, scene.end_frame(kStep));
            scene.begin_frame(next);
            const Image after = draw(renderer, next, scene.end_frame(1.0));
            const int alone = count_different(draw_finest(renderer, here, levels.model.mesh),
                                              draw_finest(renderer, next, levels.model.mesh), 8);
            worst_of_levels =
                std::max(worst_of_levels, count_different(before, changed, 8) / covered);
            worst = std::max(worst, count_different(before, after, 8) / covered);
            worst_alone = std::max(worst_alone, alone / covered);
            ++compared;
        }
        std::printf(
            "%s, level %zu, %.0f px: levels change %.2f %% of its pixels, frames %.2f %%, "
            "without levels %.2f %%\n",
            GetParam(), level, 2.0 * radius * pixels / (1.15 * near + radius),
            100.0 * worst_of_levels, 100.0 * worst, 100.0 * worst_alone);
        EXPECT_GT(compared, 50);
        EXPECT_LE(worst_of_levels, 0.02);
    }
}
INSTANTIATE_TEST_SUITE_P(Objects, SlowApproach, ::testing::Values("pine.obj", "boulder.obj"),
                         [](const auto& of) {
                             const std::string file = of.param;
                             return file.substr(0, file.find('.'));
                         });

}  // namespace slow_approach_test
}  // namespace terrane::tools
