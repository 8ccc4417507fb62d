// SPDX-License-Identifier: MIT
#include "render/render_scene.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/primitive_meshes.h>
#include <terrane/terrain/progressive_mesh.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace scene_objects_test {

using test::count_different;
using test::draw;
using test::instance_at;
using test::make_rock;
using test::make_tree;

constexpr int kWidth = 320, kHeight = 240;

class SceneObjectsTest : public test::PictureTest<kWidth, kHeight> {};

View view_of_tree(double distance) {
    const WorldPos target(0.0, 0.0, 4.0);
    const Eigen::Vector3d back(std::cos(0.1), 0.0, std::sin(0.1));
    return look_at(target + distance * back, target, 0.7, kWidth, kHeight).value();
}

TEST_F(SceneObjectsTest, AnInstanceLooksAsTheSameTrianglesStreamed) {
    TerrainRenderer renderer = make();
    const TriangleMesh tree = make_tree(24);
    const MeshId id = renderer.add_mesh(tree).value();
    const View view = view_of_tree(20.0);
    std::vector<ObjectInstance> instances = {instance_at(view, {0, 0, 0}),
                                             instance_at(view, {3, 2, 0})};
    instances[1].rotation = {0.0f, 0.0f, 0.6f, 0.8f};
    instances[1].scale = 0.5f;
    const MeshDraw both = {id, 0, 0, 2};
    const Image instanced = draw(renderer, view, {.instances = instances, .meshes = {&both, 1}});
    EXPECT_EQ(renderer.counts().objects_drawn, 2u);
    EXPECT_EQ(renderer.counts().triangles, 2 * tree.triangles.size());
    std::vector<Eigen::Vector3f> positions;
    for (const Eigen::Vector3d& p : tree.positions) positions.push_back(p.cast<float>());
    const std::vector<StreamedDraw> streamed = {{id, positions, tree.triangles, 0},
                                                {id, {}, tree.triangles, 1}};
    const Image moved = draw(renderer, view, {.instances = instances, .streamed = streamed});
    EXPECT_EQ(count_different(instanced, moved), 0);
    EXPECT_GT(count_different(instanced, draw(renderer, view, {})), 1000);
}

TEST_F(SceneObjectsTest, ALevelMorphsIntoTheNextOne) {
    TerrainRenderer renderer = make();
    ProgressiveMesh rock = ProgressiveMesh::create(make_rock(3, 5)).value();
    const std::vector<TriangleMesh::Triangle> fine(rock.triangles().begin(),
                                                   rock.triangles().end());
    const std::vector<std::uint32_t> targets = rock.geomorph_targets(60);
    rock.set_triangle_count(60);
    const std::vector<MeshLevel> levels = {{fine, targets}, {rock.triangles(), {}}};
    const MeshId id = renderer.add_mesh(rock.finest(), levels).value();
    const View view = look_at({4, 3, 2}, {0, 0, 0.3}, 0.6, kWidth, kHeight).value();
    ObjectInstance instance = instance_at(view, {0, 0, 0});
    const auto picture = [&](std::uint32_t level, float coverage) {
        instance.coverage = coverage;
        const MeshDraw one = {id, level, 0, 1};
        return draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}});
    };
    const Image finest = picture(0, 1.0f), coarser = picture(1, 1.0f);
    const int covered = count_different(finest, draw(renderer, view, {}));
    EXPECT_GT(count_different(finest, coarser, 8), covered / 10);
    // triangles that have become edges may cover a sample on the outline
    EXPECT_LE(count_different(picture(0, 2.0f), coarser, 8), covered / 200);
    // a level without targets stays
    EXPECT_EQ(count_different(picture(1, 1.5f), coarser), 0);
    Image before = finest;
    for (int step = 1; step <= 100; ++step) {
        const Image now = picture(0, 1.0f + static_cast<float>(step) / 100.0f);
        ASSERT_LE(count_different(before, now, 16), covered / 50) << step;
        before = now;
    }
}

TEST_F(SceneObjectsTest, LevelsThatMorphNeedTargetsOfTheirVertices) {
    TerrainRenderer renderer = make();
    const TriangleMesh rock = make_rock(0, 1);  // 12 vertices
    const std::vector<std::uint32_t> few(5, 0), beyond(12, 12);
    const auto message = [&](std::span<const std::uint32_t> targets) {
        const MeshLevel level = {rock.triangles, targets};
        return renderer.add_mesh(rock, {&level, 1}).error().message;
    };
    EXPECT_THAT(message(few), testing::HasSubstr("level 0 has no morph target for vertex"));
    EXPECT_EQ(message(beyond), "level 0 morphs to vertex 12 of 12");
}

TEST_F(SceneObjectsTest, ASmallStepOfCoverageChangesFewPixels) {
    TerrainRenderer renderer = make();
    const MeshId id = renderer.add_mesh(make_tree(16)).value();
    const View view = view_of_tree(12.0);
    ObjectInstance instance = instance_at(view, {0, 0, 0});
    const MeshDraw one = {id, 0, 0, 1};
    const Image whole = draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}});
    const int covered = count_different(whole, draw(renderer, view, {}));
    const auto picture = [&](int step) {
        instance.coverage = static_cast<float>(step) / 256.0f;
        return draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}});
    };
    const int stride = test::few_or_many(11, 1);
    for (int step = 256; step > 0; step -= stride) {
        ASSERT_LT(count_different(picture(step - 1), picture(step), 8), covered / 40) << step;
    }
    EXPECT_EQ(count_different(picture(256), whole), 0);
}

TEST_F(SceneObjectsTest, DrawsThatShareInstancesDrawEachOfThem) {
    TerrainRenderer renderer = make();
    const MeshId id = renderer.add_mesh(make_tree(8)).value();
    const ImpostorId impostor = renderer.add_impostor(id).value();
    const View view = view_of_tree(40.0);
    // large and small billboards in turn
    std::vector<ObjectInstance> instances;
    for (int i = 0; i < 6; ++i) {
        instances.push_back(instance_at(view, {i % 2 == 0 ? 0.0 : -250.0, 4.0 * i - 10.0, 0.0}));
    }
    const auto picture = [&](std::vector<ImpostorDraw> impostors, std::vector<MeshDraw> meshes) {
        return draw(renderer, view,
                    {.instances = instances, .meshes = meshes, .impostors = impostors});
    };
    const Image all = picture({{impostor, 0, 6}}, {});
    EXPECT_EQ(count_different(all, picture({{impostor, 0, 4}, {impostor, 2, 4}}, {})), 0);
    EXPECT_EQ(count_different(all, picture({{impostor, 3, 3}, {impostor, 0, 3}}, {})), 0);
    // a mesh among them is not moved by their order
    const Image meshes = picture({}, {{id, 0, 1, 1}});
    const Image both = picture({{impostor, 1, 1}, {impostor, 0, 6}}, {{id, 0, 1, 1}});
    EXPECT_EQ(count_different(both, picture({{impostor, 0, 6}}, {{id, 0, 1, 1}})), 0);
    EXPECT_GT(count_different(meshes, both), 100);
}

TEST_F(SceneObjectsTest, SmokeHidesWhatIsBehindItAndFadesWhereItMeetsTheGround) {
    const test::Scene world = test::make_scene();
    TerrainRenderer renderer = make();
    const View view =
        look_at({150.0, 20.0, 40.0}, {150.0, 120.0, 20.0}, 0.9, kWidth, kHeight).value();
    draw(renderer, view, {}, world.mesh());
    const Image empty = draw(renderer, view, {}, world.mesh());
    std::vector<Particle> particles;
    for (int i = 0; i < 12; ++i) {
        const LocalVec offset =
            to_local(WorldPos(140.0 + 2.0 * i, 115.0 - i, 24.0 + 3.0 * i), view.eye_world);
        particles.push_back({{offset.x(), offset.y(), offset.z()},
                             5.0f + 0.5f * static_cast<float>(i),
                             {0.75f, 0.75f, 0.75f, 0.5f}});
    }
    const Image smoke = draw(renderer, view, {.particles = particles}, world.mesh());
    EXPECT_GT(count_different(empty, smoke, 8), 1000);
    // below the ground: nothing is seen of it
    for (Particle& particle : particles) particle.offset_eye[2] -= 200.0f;
    EXPECT_EQ(count_different(empty, draw(renderer, view, {.particles = particles}, world.mesh())),
              0);
}

TEST_F(SceneObjectsTest, NothingJittersFarFromTheOrigin) {
    TerrainRenderer renderer = make();
    const MeshId id = renderer.add_mesh(make_tree(16)).value();
    const MeshDraw one = {id, 0, 0, 1};
    std::vector<Image> images;
    for (const double shift : {0.0, 1e7}) {
        View view = view_of_tree(15.0);
        view.eye_world.x() += shift;
        ObjectInstance instance = instance_at(view, {shift, 0, 0});
        images.push_back(draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}}));
    }
    EXPECT_LE(count_different(images[0], images[1]), 20);
}

TEST_F(SceneObjectsTest, WithoutObjectsNothingIsOnTheDeviceAndMeshesGoWhenRemoved) {
    TerrainRenderer renderer = make();
    EXPECT_EQ(renderer.buffer_bytes(), 0u);
    const MeshId id = renderer.add_mesh(make_tree(16)).value();
    const ImpostorId impostor = renderer.add_impostor(id).value();
    EXPECT_GT(renderer.buffer_bytes(), 100'000u);
    renderer.remove_mesh(id);
    renderer.remove_impostor(impostor);
    EXPECT_EQ(renderer.buffer_bytes(), 0u);
}

TEST_F(SceneObjectsTest, RefusesWhatItDoesNotHaveByItsName) {
    TerrainRenderer renderer = make();
    const View view = view_of_tree(20.0);
    const auto message = [&](const SceneDraws& draws) {
        const Result<void> drawn = renderer.draw({}, view, draws);
        return drawn ? std::string() : drawn.error().message;
    };
    const ObjectInstance instance = instance_at(view, {0, 0, 0});
    const MeshDraw unknown = {MeshId{7}, 0, 0, 1};
    EXPECT_EQ(message({.instances = {&instance, 1}, .meshes = {&unknown, 1}}),
              "the renderer has no mesh 7");
    TriangleMesh tree = make_tree(3);
    const MeshId id = renderer.add_mesh(tree).value();
    const MeshDraw level = {id, 3, 0, 1};
    EXPECT_EQ(message({.instances = {&instance, 1}, .meshes = {&level, 1}}),
              "the mesh has 1 levels, got level 3");
    const MeshDraw range = {id, 0, 0, 2};
    EXPECT_EQ(message({.instances = {&instance, 1}, .meshes = {&range, 1}}),
              "the scene has 1 instances, a draw's end at 2");
    const ImpostorDraw impostor = {ImpostorId{2}, 0, 1};
    EXPECT_EQ(message({.instances = {&instance, 1}, .impostors = {&impostor, 1}}),
              "the renderer has no impostor 2");
    const TriangleMesh::Triangle beyond = {0, 1, 1000};
    const StreamedDraw streamed = {id, {}, {&beyond, 1}, 0};
    EXPECT_EQ(message({.instances = {&instance, 1}, .streamed = {&streamed, 1}}),
              "a streamed triangle names vertex 1000 of " + std::to_string(tree.positions.size()));
    EXPECT_EQ(message({}), "");
    tree.positions[4].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(renderer.add_mesh(tree).error().message,
              "coordinates must be within 1e+06 m, got nan at vertex 4");
    EXPECT_EQ(renderer.add_impostor(id, {.views_around = 2}).error().message,
              "views_around must be 4 to 64, got 2");
    EXPECT_EQ(renderer.add_impostor(MeshId{9}).error().message, "the renderer has no mesh 9");
    const MeshId nothing = renderer.add_mesh({}).value();
    EXPECT_EQ(renderer.add_impostor(nothing).error().message,
              "an impostor needs a mesh with triangles");
    const MeshDraw empty = {nothing, 0, 0, 1};
    EXPECT_EQ(message({.instances = {&instance, 1}, .meshes = {&empty, 1}}), "");
}

}  // namespace scene_objects_test

// Particles with images, against coloured quarters, soft discs and walls.

namespace particle_images_test {

using test::count_different;
using test::draw;

constexpr int kWidth = 320, kHeight = 240;
constexpr int kCentreX = kWidth / 2, kCentreY = kHeight / 2;
constexpr int kQuarter =
    33;  // pixels from the centre to the middle of a quarter of a particle of 2 m at 10 m

using Rgb = std::array<std::uint8_t, 3>;
constexpr Rgb kRed{255, 0, 0}, kGreen{0, 255, 0}, kBlue{0, 0, 255}, kWhite{255, 255, 255};

class ParticleImages : public test::PictureTest<kWidth, kHeight> {
protected:
    static View view() { return view_from({-10.0, 0.0, 0.0}, WorldPos::Zero(), 0.7); }
    static Particle particle_at(double x, ParticleImageId image) {
        return {.offset_eye = {static_cast<float>(x + 10.0), 0.0f, 0.0f},
                .radius = 2.0f,
                .image = image};
    }
};

// Quarters from the upper left one on, row by row. One pixel is nearly opaque: the image has an opacity of its own.
std::shared_ptr<const TextureImage> quarters(const std::array<Rgb, 4>& colours) {
    constexpr int kSide = 32;
    TextureImage image = {kSide, kSide, {}};
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const std::size_t quarter =
                (row < kSide / 2 ? 0u : 2u) + (column < kSide / 2 ? 0u : 1u);
            image.rgba.insert(image.rgba.end(), colours[quarter].begin(), colours[quarter].end());
            image.rgba.push_back(row + column == 0 ? 254 : 255);
        }
    }
    return std::make_shared<const TextureImage>(std::move(image));
}

std::shared_ptr<const TextureImage> plain(const Rgb& colour) {
    return quarters({colour, colour, colour, colour});
}

// The channel that is above the two others by 40 levels or more: 'r', 'g', 'b'; '-': none.
char strongest(const Image& image, int x, int y) {
    const std::uint8_t* const rgb = test::pixel(image, x, y);
    for (int k = 0; k < 3; ++k) {
        if (rgb[k] >= 40 + std::max(rgb[(k + 1) % 3], rgb[(k + 2) % 3])) return "rgb"[k];
    }
    return '-';
}

TEST_F(ParticleImages, AreShownToTheirCornersAndTurnCounterClockwise) {
    TerrainRenderer renderer = make();
    Particle particle = particle_at(
        0.0, renderer.add_particle_image(quarters({kRed, kGreen, kBlue, kWhite})).value());
    const auto corners_at = [&](float turn, int from_centre) {
        particle.turn = turn;
        const Image image = draw(renderer, view(), {.particles = {&particle, 1}});
        std::string found;
        for (const int down : {-1, 1}) {
            for (const int right : {-1, 1})
                found +=
                    strongest(image, kCentreX + right * from_centre, kCentreY + down * from_centre);
        }
        return found;
    };
    EXPECT_EQ(corners_at(0.0f, kQuarter), "rgb-");
    EXPECT_EQ(corners_at(1.5707964f, kQuarter), "g-rb");
    EXPECT_EQ(corners_at(3.1415927f, kQuarter), "-bgr");
    EXPECT_EQ(corners_at(0.0f, 60), "rgb-") << "outside the disc";
}

TEST_F(ParticleImages, AnImageWithoutOpacityHasThatOfADisc) {
    TerrainRenderer renderer = make();
    TextureImage white = {128, 128, std::vector<std::uint8_t>(4 * 128 * 128, 255)};
    const ParticleImageId image =
        renderer.add_particle_image(std::make_shared<const TextureImage>(std::move(white))).value();
    Particle disc = particle_at(0.0, ParticleImageId::soft_disc), shown = particle_at(0.0, image);
    disc.colour = shown.colour = {0.5f, 0.3f, 0.2f, 0.9f};
    const Image sky = draw(renderer, view(), {});
    const Image expected = draw(renderer, view(), {.particles = {&disc, 1}});
    EXPECT_GT(count_different(sky, expected, 8), 8000);
    for (const float turn : {0.0f, 1.0f}) {
        shown.turn = turn;
        const Image picture = draw(renderer, view(), {.particles = {&shown, 1}});
        EXPECT_LE(test::largest_difference(expected, picture), 3) << turn;
    }
}

TEST_F(ParticleImages, CoverWhatIsBeforeThemInTheListAndFadeAtWalls) {
    TerrainRenderer renderer = make();
    const ParticleImageId red = renderer.add_particle_image(plain(kRed)).value();
    const ParticleImageId green = renderer.add_particle_image(plain(kGreen)).value();
    Particle disc = particle_at(0.0, ParticleImageId::soft_disc);
    disc.colour = {0.0f, 0.0f, 1.0f, 1.0f};
    const auto last_of = [&](std::vector<Particle> particles) {
        const Image image = draw(renderer, view(), {.particles = particles});
        return strongest(image, kCentreX, kCentreY);
    };
    EXPECT_EQ(last_of({particle_at(2.0, red), particle_at(0.0, green)}), 'g');
    EXPECT_EQ(last_of({particle_at(2.0, green), particle_at(0.0, red)}), 'r');
    EXPECT_EQ(last_of({disc, particle_at(-1.0, red)}), 'r');
    EXPECT_EQ(last_of({particle_at(2.0, red), disc}), 'b');
    EXPECT_EQ(last_of({particle_at(2.0, red), disc, particle_at(-1.0, green)}), 'g');
    // a wall whose face towards the eye is at x = 0
    const MeshId wall = renderer.add_mesh(make_box_mesh({0.5, 20.0, 20.0}).value()).value();
    const ObjectInstance instance = test::instance_at(view(), {0.5, 0.0, 0.0});
    const MeshDraw wall_draw = {wall, 0, 0, 1};
    const auto redness = [&](double x) {
        const Particle particle = particle_at(x, red);
        const Image image = draw(
            renderer, view(),
            {.instances = {&instance, 1}, .meshes = {&wall_draw, 1}, .particles = {&particle, 1}});
        const std::uint8_t* const rgb = test::pixel(image, kCentreX, kCentreY);
        return rgb[0] - rgb[1];
    };
    const int none = redness(4.0), half = redness(0.0), full = redness(-4.0);
    EXPECT_GT(full, none + 80);
    EXPECT_NEAR(half, (none + full) / 2, full / 6);
}

TEST_F(ParticleImages, ShareTheLimitOfTexturesAndGoWhenRemoved) {
    constexpr std::size_t kLimit = 6'000;  // an image of 32 x 32 with mipmaps takes 5,460 bytes
    TerrainRenderer renderer = make({.texture_bytes = kLimit});
    TextureImage large = {64, 64, std::vector<std::uint8_t>(4 * 64 * 64, 200)};
    const ParticleImageId image =
        renderer.add_particle_image(std::make_shared<const TextureImage>(std::move(large))).value();
    const Particle particle = particle_at(0.0, image);
    draw(renderer, view(), {.particles = {&particle, 1}});
    EXPECT_EQ(renderer.counts().textures_reduced, 1u);
    EXPECT_LE(renderer.buffer_bytes(), kLimit);
    renderer.remove_particle_image(image);
    EXPECT_EQ(renderer.buffer_bytes(), 0u);
    EXPECT_EQ(renderer.draw({}, view(), {.particles = {&particle, 1}}).error().message,
              "the renderer has no image of particles 1");
    EXPECT_EQ(renderer.add_particle_image(nullptr).error().message,
              "an image of particles must not be null");
    EXPECT_EQ(
        renderer.add_particle_image(std::make_shared<const TextureImage>(TextureImage{2, 1, {}}))
            .error()
            .message,
        "image must have sides of 1 to 16384 pixels and 4 bytes a pixel, got 2 x 1 pixels and 0 "
        "bytes");
}

}  // namespace particle_images_test

// A ray through a pixel meets the object that the pixel shows.

namespace picking_test {

constexpr int kWidth = 200, kHeight = 140;

class Picking : public test::PictureTest<kWidth, kHeight> {};

// Rocks of one colour on a sky: a pixel that differs from the sky shows a rock.
TEST_F(Picking, RaysThroughPixelsMeetTheObjectsThatTheyShow) {
    TerrainRenderer renderer = make({.sample_count = 1});
    const TriangleMesh mesh = test::make_rock(2, 4);
    ObjectModel model;
    model.mesh = renderer.add_mesh(mesh).value();
    model.bounds = {Eigen::Vector3d::Constant(-2.0), Eigen::Vector3d::Constant(2.0)};
    model.levels = {{0.0, static_cast<std::uint32_t>(mesh.triangles.size()), 0, false}};
    model.absence_error_m = 2.0;
    model.rays = MeshRays::create(mesh).value();
    Scene scene = Scene::create({}).value();
    const ModelId rock = scene.add_model(model).value();
    test::Random random(5);
    const WorldPos middle(-4000.0, 7000.0, 500.0);
    std::vector<PlacedObject> objects(40);
    for (PlacedObject& object : objects) {
        object.position = middle + random.between(0.0, 9.0) * random.direction();
        object.scale = static_cast<float>(random.between(0.5, 1.5));
    }
    ASSERT_TRUE(scene.add(scene.root(), {}, InstancesNode{rock, objects}));
    for (const double fov : {0.3, 1.0, 2.2}) {
        const View view =
            view_from(middle + WorldPos(14.0, -11.0, 5.0), middle + WorldPos(0, 0, 1), fov);
        const Image sky = test::draw(renderer, view, {});
        scene.begin_frame(view);
        const Image image = test::draw(renderer, view, scene.end_frame(0.01));
        int shown = 0, different = 0;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                const bool is_shown = !test::is_same(image, sky, x, y);
                const Eigen::Vector3d along = direction_through(view, x + 0.5, y + 0.5);
                const bool is_met =
                    scene.ray(view.eye_world, view.eye_world + 100.0 * along).has_value();
                shown += is_shown ? 1 : 0;
                different += is_shown != is_met ? 1 : 0;
            }
        }
        EXPECT_GT(shown, 150) << fov;
        // the rasteriser rounds vertices to a 256th of a pixel
        EXPECT_LE(different, shown / 100) << fov;
    }
}

}  // namespace picking_test
}  // namespace terrane
