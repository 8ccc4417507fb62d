// SPDX-License-Identifier: MIT
#include "render/gl_test.h"
#include "render/scene.h"
#include "support/meshes/objects.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/progressive_mesh.h>

#include <gtest/gtest.h>

#include <vector>

namespace terrane {
namespace solid_parts_test {

using test::count_different;
using test::make_rock;
using test::Random;

constexpr int kWidth = 320, kHeight = 240;

class SolidPartsTest : public test::GlTest {
protected:
    TerrainRenderer make(int samples = 1) {
        RendererSettings settings;
        settings.sample_count = samples;
        return TerrainRenderer::create(*context_, kWidth, kHeight, settings).value();
    }
    // The picture of instances of a mesh; its triangles in clusters, or streamed, which has no clusters.
    static Image draw(TerrainRenderer& renderer, const View& view, MeshId id,
                      std::span<const ObjectInstance> instances) {
        const MeshDraw all = {id, 0, 0, static_cast<std::uint32_t>(instances.size())};
        const Result<void> drawn =
            renderer.draw({}, view, {}, {.instances = instances, .meshes = {&all, 1}});
        EXPECT_TRUE(drawn) << drawn.error().message;
        return renderer.read();
    }
    static Image draw_streamed(TerrainRenderer& renderer, const View& view, MeshId id,
                               std::span<const TriangleMesh::Triangle> triangles,
                               std::span<const ObjectInstance> instances) {
        std::vector<StreamedDraw> streamed;
        for (std::uint32_t i = 0; i < instances.size(); ++i)
            streamed.push_back({.mesh = id, .triangles = triangles, .instance = i});
        const Result<void> drawn =
            renderer.draw({}, view, {}, {.instances = instances, .streamed = streamed});
        EXPECT_TRUE(drawn) << drawn.error().message;
        EXPECT_EQ(renderer.counts().triangles_culled, 0u);
        return renderer.read();
    }
};

View view_from(const WorldPos& eye) {
    return look_at(eye, {0, 0, 0}, 0.9, kWidth, kHeight).value();
}

// Turned, of different sizes, at `distance` and beyond, some of them across the edges of the picture.
std::vector<ObjectInstance> scattered(const View& view, double distance, Random& random) {
    std::vector<ObjectInstance> instances;
    for (int i = 0; i < 8; ++i) {
        ObjectInstance& instance = instances.emplace_back();
        const WorldPos place =
            view.eye_world + distance * random.between(1.0, 2.0) *
                                 (view.forward + 0.6 * random.direction()).normalized();
        const LocalVec offset = to_local(place, view.eye_world);
        instance.offset_eye = {offset.x(), offset.y(), offset.z()};
        instance.scale = static_cast<float>(random.between(0.5, 1.5));
        const Eigen::Quaterniond q(random.rotation());
        instance.rotation = {static_cast<float>(q.x()), static_cast<float>(q.y()),
                             static_cast<float>(q.z()), static_cast<float>(q.w())};
    }
    return instances;
}

TEST_F(SolidPartsTest, PicturesAreThoseOfAllTriangles) {
    constexpr std::uint64_t kSeed = 31;
    Random random(kSeed);
    TriangleMesh closed = make_rock(4, 5), open = closed;
    std::erase_if(open.triangles,
                  [&](const TriangleMesh::Triangle&) { return random.below(3) == 0; });
    for (const int samples : {1, 4}) {
        TerrainRenderer renderer = make(samples);
        for (const TriangleMesh* mesh : {&closed, &open}) {
            const MeshId id = renderer.add_mesh(*mesh).value();
            std::size_t culled = 0, all = 0;
            for (const double distance : {0.5, 1.2, 2.0, 5.0, 20.0, 100.0}) {
                const View view = view_from(5.0 * random.direction());
                const std::vector<ObjectInstance> instances = scattered(view, distance, random);
                const Image parts = draw(renderer, view, id, instances);
                culled += renderer.counts().triangles_culled;
                all += renderer.counts().triangles;
                EXPECT_EQ(renderer.counts().triangles, 8 * mesh->triangles.size());
                EXPECT_EQ(renderer.counts().objects_drawn, 8u);
                EXPECT_EQ(count_different(
                              parts, draw_streamed(renderer, view, id, mesh->triangles, instances)),
                          0)
                    << samples << " samples, from " << distance << " m, seed " << kSeed;
            }
            EXPECT_GT(culled, all / 6);
        }
    }
}

TEST_F(SolidPartsTest, NothingIsCulledOfWhatShowsBothSidesOrMayTurn) {
    TerrainRenderer renderer = make();
    Random random(32);
    const TriangleMesh rock = make_rock(4, 5);
    const View view = view_from({5, 0, 0});
    std::vector<ObjectInstance> instances = scattered(view, 4.0, random);
    const auto culled = [&](MeshId id) {
        draw(renderer, view, id, instances);
        return renderer.counts().triangles_culled;
    };
    const MeshId one_sided = renderer.add_mesh(rock).value();
    EXPECT_GT(culled(one_sided), 0u);
    EXPECT_EQ(culled(renderer.add_mesh(rock, {}, {.is_two_sided = true}).value()), 0u);

    ProgressiveMesh progressive = ProgressiveMesh::create(rock).value();
    const std::vector<TriangleMesh::Triangle> fine(progressive.triangles().begin(),
                                                   progressive.triangles().end());
    const std::vector<std::uint32_t> targets = progressive.geomorph_targets(200);
    const MeshLevel level = {fine, targets};
    const MeshId morphing = renderer.add_mesh(progressive.finest(), {&level, 1}).value();
    EXPECT_GT(culled(morphing), 0u);
    for (ObjectInstance& instance : instances) instance.coverage = 1.5f;
    EXPECT_EQ(culled(morphing), 0u);
    EXPECT_GT(culled(one_sided), 0u);  // has no targets

    // a frame without objects
    ASSERT_TRUE(renderer.draw({}, view));
    EXPECT_EQ(renderer.counts().triangles_culled, 0u);
}

TEST_F(SolidPartsTest, InstancesThatAreDrawnWholeKeepTheirOrderAmongThoseInParts) {
    TerrainRenderer renderer = make();
    Random random(33);
    const TriangleMesh rock = make_rock(4, 5);
    const MeshId id = renderer.add_mesh(rock).value();
    const View view = view_from({5, 0, 0});
    std::vector<ObjectInstance> instances = scattered(view, 4.0, random);
    // far ones in twos, and one whose quaternion is far from unit length
    for (const std::size_t far : {2u, 3u, 6u, 7u}) {
        for (float& coordinate : instances[far].offset_eye) coordinate *= 1000.0f;
        instances[far].scale *= 1000.0f;
    }
    for (float& coordinate : instances[4].rotation) coordinate *= 1.1f;
    for (ObjectInstance& instance : instances) instance.coverage = 0.7f;
    const Image parts = draw(renderer, view, id, instances);
    EXPECT_GT(renderer.counts().triangles_culled, 0u);
    EXPECT_EQ(count_different(parts, draw_streamed(renderer, view, id, rock.triangles, instances)),
              0);
}

}  // namespace solid_parts_test
}  // namespace terrane
