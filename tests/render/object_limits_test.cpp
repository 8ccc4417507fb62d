// SPDX-License-Identifier: MIT
#include "render/render_scene.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/progressive_mesh.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace terrane {
namespace object_limits_test {

using test::count_different;
using test::draw;
using test::make_rock;
using test::make_tree;

constexpr int kWidth = 160, kHeight = 120;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

class ObjectLimitsTest : public test::PictureTest<kWidth, kHeight> {
protected:
    static std::string message(TerrainRenderer& renderer, const View& view,
                               const SceneDraws& draws) {
        const Result<void> drawn = renderer.draw({}, view, draws);
        return drawn ? std::string() : drawn.error().message;
    }
};

View view_of_origin() {
    return look_at({25.0, 0.0, 8.0}, {0.0, 0.0, 4.0}, 0.7, kWidth, kHeight).value();
}

ObjectInstance instance_at_origin(const View& view) {
    return test::instance_at(view, WorldPos::Zero());
}

TEST_F(ObjectLimitsTest, NumbersThatAreNotFiniteOrOutOfRangeAreRefusedByTheirPlace) {
    TerrainRenderer renderer = make();
    const View view = view_of_origin();
    const MeshId id = renderer.add_mesh(make_tree(5)).value();
    std::vector<ObjectInstance> instances(3, instance_at_origin(view));
    const MeshDraw all = {id, 0, 0, 3};
    const SceneDraws draws = {.instances = instances, .meshes = {&all, 1}};
    const Image before = draw(renderer, view, draws);
    const ObjectInstance good = instances[1];
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
        for (float* value :
             {&instances[1].offset_eye[2], &instances[1].scale, &instances[1].rotation[0],
              &instances[1].coverage, &instances[1].tint[2]}) {
            *value = bad;
            EXPECT_EQ(message(renderer, view, draws), "instance 1 must have finite numbers only");
            instances[1] = good;
        }
    }
    instances[2].scale = 0.0f;
    EXPECT_EQ(message(renderer, view, draws), "instance 2 must have a scale > 0, got 0");
    instances[2].scale = 1.0f;
    instances[2].coverage = -1.5f;
    EXPECT_EQ(message(renderer, view, draws),
              "instance 2 must have a coverage of -1 to 2, got -1.5");
    instances[2] = good;
    Particle particle;
    particle.colour[3] = kNan;
    EXPECT_EQ(message(renderer, view, {.particles = {&particle, 1}}),
              "particle 0 must have finite numbers and a radius > 0, got 1");
    particle = {.turn = kInfinity};
    EXPECT_EQ(message(renderer, view, {.particles = {&particle, 1}}),
              "particle 0 must have finite numbers and a radius > 0, got 1");
    std::vector<Eigen::Vector3f> positions(make_tree(5).positions.size(), Eigen::Vector3f::Zero());
    positions[6].y() = kNan;
    const TriangleMesh::Triangle triangle = {0, 1, 2};
    const StreamedDraw streamed = {id, positions, {&triangle, 1}, 0};
    EXPECT_EQ(message(renderer, view, {.instances = instances, .streamed = {&streamed, 1}}),
              "a streamed object must have finite positions, got one that is not at vertex 6");
    // the last frame is kept
    EXPECT_EQ(count_different(before, renderer.read()), 0);
}

TEST_F(ObjectLimitsTest, HugeCountsAndRangesThatWrapAreRefused) {
    TerrainRenderer renderer = make();
    const View view = view_of_origin();
    const MeshId id = renderer.add_mesh(make_tree(5)).value();
    const ImpostorId impostor = renderer.add_impostor(id, {.texels = 8}).value();
    const ObjectInstance instance = instance_at_origin(view);
    const std::span<const ObjectInstance> one(&instance, 1);
    const MeshDraw wrapping = {id, 0, 0xffffffffu, 2};
    EXPECT_EQ(message(renderer, view, {.instances = one, .meshes = {&wrapping, 1}}),
              "the scene has 1 instances, a draw's end at 4294967297");
    const ImpostorDraw huge = {impostor, 0, 0xffffffffu};
    EXPECT_EQ(message(renderer, view, {.instances = one, .impostors = {&huge, 1}}),
              "the scene has 1 instances, a draw's end at 4294967295");
    const TriangleMesh::Triangle triangle = {0, 1, 2};
    const StreamedDraw beyond = {id, {}, {&triangle, 1}, 0xffffffffu};
    EXPECT_EQ(message(renderer, view, {.instances = one, .streamed = {&beyond, 1}}),
              "the scene has 1 instances, a draw's end at 4294967296");
}

TEST_F(ObjectLimitsTest, NoInstancesAreNoPassAndNoChange) {
    const test::Scene world = test::make_scene();
    const View view = view_from({250.0, 20.0, 40.0}, {250.0, 140.0, 0.0});
    TerrainRenderer plain = make(), other = make();
    const MeshId id = other.add_mesh(make_tree(5)).value();
    const ImpostorId impostor = other.add_impostor(id, {.texels = 8}).value();
    const MeshDraw mesh = {id, 0, 0, 0};
    const ImpostorDraw flat = {impostor, 0, 0};
    const StreamedDraw streamed = {id, {}, {}, 0};
    const ObjectInstance instance = instance_at_origin(view);
    const Image a = draw(plain, view, {}, world.mesh());
    const Image b = draw(other, view,
                         {.instances = {&instance, 1},
                          .meshes = {&mesh, 1},
                          .streamed = {&streamed, 1},
                          .impostors = {&flat, 1}},
                         world.mesh());
    EXPECT_EQ(count_different(a, b), 0);
    EXPECT_EQ(other.counts().objects_drawn, 0u);
    EXPECT_EQ(other.counts().triangles, 0u);
}

TEST_F(ObjectLimitsTest, TenThousandInstancesAreOneDrawAndLookAsOneAtATime) {
    TerrainRenderer renderer = make({.sample_count = 1});
    const View view = view_of_origin();
    const MeshId id = renderer.add_mesh(make_rock(0, 3)).value();
    std::vector<ObjectInstance> instances(10'000, instance_at_origin(view));
    for (std::size_t i = 0; i < instances.size(); ++i) {
        const auto row = i / 100;
        instances[i].offset_eye[0] -= 0.5f * static_cast<float>(row);
        instances[i].offset_eye[1] += 0.5f * static_cast<float>(i % 100) - 25.0f;
    }
    const MeshDraw all = {id, 0, 0, 10'000};
    std::vector<MeshDraw> single;
    for (std::uint32_t i = 0; i < 10'000; ++i) single.push_back({id, 0, i, 1});
    const Image a = draw(renderer, view, {.instances = instances, .meshes = {&all, 1}});
    EXPECT_EQ(renderer.counts().objects_drawn, 10'000u);
    const Image b = draw(renderer, view, {.instances = instances, .meshes = single});
    EXPECT_EQ(count_different(a, b), 0);
}

// Coverages next to the thresholds, where c and 1 + (c - 1) are different floats.
TEST_F(ObjectLimitsTest, ComplementsOfCoveragesThatAreRoundedDrawEverySampleOnce) {
    const View view = view_of_origin();
    for (const int samples : {1, 4}) {
        TerrainRenderer renderer = make({.sample_count = samples});
        const MeshId id = renderer.add_mesh(make_tree(8)).value();
        std::vector<ObjectInstance> instances(2, instance_at_origin(view));
        const MeshDraw first = {id, 0, 0, 1}, second = {id, 0, 1, 1};
        const MeshDraw both[] = {first, second}, reversed[] = {second, first};
        const Image whole = draw(renderer, view, {.instances = instances, .meshes = {&first, 1}});
        int apart_count = 0;
        for (int k = 0; k < 256; k += 17) {
            const float threshold = (static_cast<float>(k) + 0.5f) / 256.0f;
            for (const float c :
                 {threshold, std::nextafter(threshold, 1.0f), std::nextafter(threshold, 0.0f)}) {
                instances[0].coverage = c;
                instances[1].coverage = c - 1.0f;
                apart_count += 1.0f + instances[1].coverage != c ? 1 : 0;
                SCOPED_TRACE(testing::Message() << c << ", " << samples << " samples");
                // in one colour samples that neither draws are seen, in two colours those that both draw
                instances[1].tint = {1.0f, 1.0f, 1.0f};
                const Image same = draw(renderer, view, {.instances = instances, .meshes = both});
                EXPECT_EQ(count_different(same, whole), 0);
                instances[1].tint = {0.0f, 0.0f, 0.0f};
                const Image a = draw(renderer, view, {.instances = instances, .meshes = both});
                const Image b = draw(renderer, view, {.instances = instances, .meshes = reversed});
                EXPECT_EQ(count_different(a, b), 0);
            }
        }
        EXPECT_GT(apart_count, 10);
    }
}

}  // namespace object_limits_test

namespace solid_parts_test {

using test::count_different;
using test::make_rock;
using test::Random;

constexpr int kWidth = 320, kHeight = 240;

class SolidPartsTest : public test::PictureTest<kWidth, kHeight> {
protected:
    // The picture of instances of a mesh; its triangles in clusters, or streamed, which has no clusters.
    static Image draw_parts(TerrainRenderer& renderer, const View& view, MeshId id,
                            std::span<const ObjectInstance> instances) {
        const MeshDraw all = {id, 0, 0, static_cast<std::uint32_t>(instances.size())};
        return test::draw(renderer, view, {.instances = instances, .meshes = {&all, 1}});
    }
    static Image draw_streamed(TerrainRenderer& renderer, const View& view, MeshId id,
                               std::span<const TriangleMesh::Triangle> triangles,
                               std::span<const ObjectInstance> instances) {
        std::vector<StreamedDraw> streamed;
        for (std::uint32_t i = 0; i < instances.size(); ++i)
            streamed.push_back({.mesh = id, .triangles = triangles, .instance = i});
        const Image image =
            test::draw(renderer, view, {.instances = instances, .streamed = streamed});
        EXPECT_EQ(renderer.counts().triangles_culled, 0u);
        return image;
    }
};

// Turned, of different sizes, at `distance` and beyond, some of them across the edges of the picture.
std::vector<ObjectInstance> scattered(const View& view, double distance, Random& random) {
    std::vector<ObjectInstance> instances;
    for (int i = 0; i < 8; ++i) {
        const WorldPos place =
            view.eye_world + distance * random.between(1.0, 2.0) *
                                 (view.forward + 0.6 * random.direction()).normalized();
        ObjectInstance& instance = instances.emplace_back(test::instance_at(view, place));
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
        TerrainRenderer renderer = make({.sample_count = samples});
        for (const TriangleMesh* mesh : {&closed, &open}) {
            const MeshId id = renderer.add_mesh(*mesh).value();
            std::size_t culled = 0, all = 0;
            for (const double distance : {0.5, 1.2, 2.0, 5.0, 20.0, 100.0}) {
                const View view = view_from(5.0 * random.direction(), {0, 0, 0}, 0.9);
                const std::vector<ObjectInstance> instances = scattered(view, distance, random);
                const Image parts = draw_parts(renderer, view, id, instances);
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
    TerrainRenderer renderer = make({.sample_count = 1});
    Random random(32);
    const TriangleMesh rock = make_rock(4, 5);
    const View view = view_from({5, 0, 0}, {0, 0, 0}, 0.9);
    std::vector<ObjectInstance> instances = scattered(view, 4.0, random);
    const auto culled = [&](MeshId id) {
        draw_parts(renderer, view, id, instances);
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
    TerrainRenderer renderer = make({.sample_count = 1});
    Random random(33);
    const TriangleMesh rock = make_rock(4, 5);
    const MeshId id = renderer.add_mesh(rock).value();
    const View view = view_from({5, 0, 0}, {0, 0, 0}, 0.9);
    std::vector<ObjectInstance> instances = scattered(view, 4.0, random);
    // far ones in twos, and one whose quaternion is far from unit length
    for (const std::size_t far : {2u, 3u, 6u, 7u}) {
        for (float& coordinate : instances[far].offset_eye) coordinate *= 1000.0f;
        instances[far].scale *= 1000.0f;
    }
    for (float& coordinate : instances[4].rotation) coordinate *= 1.1f;
    for (ObjectInstance& instance : instances) instance.coverage = 0.7f;
    const Image parts = draw_parts(renderer, view, id, instances);
    EXPECT_GT(renderer.counts().triangles_culled, 0u);
    EXPECT_EQ(count_different(parts, draw_streamed(renderer, view, id, rock.triangles, instances)),
              0);
}

}  // namespace solid_parts_test
}  // namespace terrane
