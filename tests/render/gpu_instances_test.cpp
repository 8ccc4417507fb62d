// SPDX-License-Identifier: MIT
//
// Instances of a scene whose levels a device chooses, against those of the CPU: demands, counts, draws and instances,
// bit for bit, in random scenes, views and thresholds. 400 frames; 12,000 in long runs.
#include "objects/gpu_instances.h"

#include "render/render_scene.h"
#include "scene/random_scene.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/render/upload_levels.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/scene/object_levels.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/primitive_meshes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test {
namespace gpu_instances_test {

const int kScenes = few_or_many(20, 600);
constexpr int kFrames = 20;  // per scene
constexpr int kMostModels = 4;

// What a frame draws of a level, with the instances in the order of their ranges.
struct Drawn {
    std::uint32_t id = 0, level = 0;
    std::vector<ObjectInstance> instances;
};

std::vector<Drawn> meshes_of(std::span<const MeshDraw> draws, std::span<const ObjectInstance> all) {
    std::vector<Drawn> found;
    for (const MeshDraw& draw : draws) {
        const auto part = all.subspan(draw.first_instance, draw.instance_count);
        found.push_back({static_cast<std::uint32_t>(draw.mesh), draw.level,
                         std::vector(part.begin(), part.end())});
    }
    return found;
}

constexpr int kTexels = 16;
// The radius of the impostor of a cube of 2 m, with its margin of a texel.
const auto kCubeRadius = static_cast<float>(std::sqrt(3.0) * (1.0 + 2.0 / kTexels));

// Instances of an impostor: the small ones in order, then the others from the last one on.
Drawn sorted(const ImpostorDraw& draw, std::span<const ObjectInstance> all, float most_squared) {
    std::vector<ObjectInstance> small, large;
    for (const ObjectInstance& each : all.subspan(draw.first_instance, draw.instance_count)) {
        const auto& [x, y, z] = each.offset_eye;
        const bool is_small = each.scale * each.scale <= most_squared * (x * x + y * y + z * z);
        (is_small ? small : large).push_back(each);
    }
    small.insert(small.end(), large.rbegin(), large.rend());
    return {static_cast<std::uint32_t>(draw.impostor), 0, std::move(small)};
}

// The draws on a device, followed by those of the CPU, as those of the CPU alone.
std::vector<Drawn> joined(std::vector<Drawn> of_device, const std::vector<Drawn>& of_cpu) {
    for (const Drawn& draw : of_cpu) {
        const auto same = std::ranges::find_if(of_device, [&](const Drawn& each) {
            return each.id == draw.id && each.level == draw.level;
        });
        if (same == of_device.end()) {
            of_device.push_back(draw);
        } else {
            same->instances.insert(same->instances.end(), draw.instances.begin(),
                                   draw.instances.end());
        }
    }
    return of_device;
}

auto bits_of(const ObjectInstance& instance) {
    return std::bit_cast<std::array<std::uint32_t, sizeof(instance) / 4>>(instance);
}

std::string difference(std::vector<Drawn> expected, std::vector<Drawn> found) {
    const auto before = [](const Drawn& a, const Drawn& b) {
        return std::pair(a.id, a.level) < std::pair(b.id, b.level);
    };
    std::ranges::sort(expected, before);
    std::ranges::sort(found, before);
    if (expected.size() != found.size()) return "number of draws";
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const Drawn &a = expected[i], &b = found[i];
        const std::string place =
            "mesh or impostor " + std::to_string(a.id) + ", level " + std::to_string(a.level);
        if (a.id != b.id || a.level != b.level) return place + " is not drawn";
        if (a.instances.size() != b.instances.size()) return place + ": number of instances";
        for (std::size_t k = 0; k < a.instances.size(); ++k) {
            if (bits_of(a.instances[k]) != bits_of(b.instances[k]))
                return place + ": instance " + std::to_string(k);
        }
    }
    return "";
}

std::vector<ObjectInstance> read(const SceneDraws& draws) {
    if (draws.device == nullptr) return {};
    std::vector<ObjectInstance> instances(draws.device->count);
    glGetNamedBufferSubData(draws.device->buffer, 0,
                            static_cast<GLsizeiptr>(instances.size() * sizeof(ObjectInstance)),
                            instances.data());
    return instances;
}

// Two scenes with the same nodes, the second one with a device.
struct Pair {
    terrane::Scene cpu, gpu;

    Pair(const SceneSettings& settings, internal::InstanceDevice* device)
        : cpu(terrane::Scene::create(settings).value()),
          gpu(terrane::Scene::create(settings).value()) {
        gpu.set_device(device);
    }
    ModelId add(const ObjectModel& model) {
        (void)gpu.add_model(model).value();
        return cpu.add_model(model).value();
    }
    NodeId add(const NodePlace& place, const NodeContent& content) {
        (void)gpu.add(gpu.root(), place, content).value();
        return cpu.add(cpu.root(), place, content).value();
    }
    void remove(NodeId node) {
        cpu.remove(node);
        gpu.remove(node);
    }
};

// Compares a frame, and returns the number of instances on the device.
std::size_t compare(Pair& pair, const View& view, double least_px, double threshold_px,
                    std::span<const ImpostorId> cubes, const HorizonMap* horizon = nullptr) {
    const auto demands = pair.cpu.begin_frame(view, least_px, {}, horizon);
    const auto of_device = pair.gpu.begin_frame(view, least_px, {}, horizon);
    EXPECT_EQ(demands.size(), of_device.size());
    for (std::size_t i = 0; i < std::min(demands.size(), of_device.size()); ++i) {
        EXPECT_EQ(demands[i].threshold_px, of_device[i].threshold_px);
        EXPECT_EQ(demands[i].triangles, of_device[i].triangles);
    }
    const SceneDraws a = pair.cpu.end_frame(threshold_px);
    const SceneDraws b = pair.gpu.end_frame(threshold_px);
    EXPECT_EQ(a.device, nullptr);
    const SceneCounts &expected = pair.cpu.counts(), &found = pair.gpu.counts();
    EXPECT_EQ(found.in_view, expected.in_view);
    EXPECT_EQ(found.occluded, expected.occluded);
    EXPECT_EQ(found.occluded_share, expected.occluded_share);
    EXPECT_EQ(found.drawn, expected.drawn);
    EXPECT_EQ(found.left_out, expected.left_out);
    EXPECT_EQ(found.triangles, expected.triangles);
    const std::vector<ObjectInstance> instances = read(b);
    EXPECT_EQ(
        difference(meshes_of(a.meshes, a.instances),
                   joined(meshes_of(b.device_meshes, instances), meshes_of(b.meshes, b.instances))),
        "");
    // the device has its impostors sorted; those of the CPU's part are the last in a draw
    std::vector<Drawn> wanted;
    for (const ImpostorDraw& draw : a.impostors) {
        const auto same = std::ranges::find_if(
            b.impostors, [&](const ImpostorDraw& each) { return each.impostor == draw.impostor; });
        ImpostorDraw of_instances = draw;
        if (same != b.impostors.end()) of_instances.instance_count -= same->instance_count;
        if (of_instances.instance_count == 0) continue;
        // others are not known to the renderer: none of them is small
        const float most_squared =
            std::ranges::find(cubes, draw.impostor) != cubes.end()
                ? internal::most_small_squared(view.pixels_per_radian(), kCubeRadius)
                : 0.0f;
        wanted.push_back(sorted(of_instances, a.instances, most_squared));
    }
    std::vector<Drawn> got;
    for (const ImpostorDraw& draw : b.device_impostors) {
        const auto part = std::span(instances).subspan(draw.first_instance, draw.instance_count);
        got.push_back(
            {static_cast<std::uint32_t>(draw.impostor), 0, std::vector(part.begin(), part.end())});
    }
    EXPECT_EQ(difference(wanted, got), "");
    return instances.size();
}

View random_view(Random& random, double spread) {
    View view;
    for (;;) {
        const double reach = random.below(20) == 0 ? 0.9 * kFarthestEye : spread;
        const WorldPos eye = random.between(0.0, 1.1) * reach * random.direction();
        const Eigen::Vector3d ahead =
            random.below(2) == 0 ? random.direction() : Eigen::Vector3d(-eye);
        const auto made = look_at(eye, eye + ahead, random.between(0.1, 2.5),
                                  100 + random.below(2000), 100 + random.below(2000));
        if (!made) continue;
        view = *made;
        break;
    }
    view.near_distance = std::exp2(random.between(-10.0, 4.0));
    return view;
}

class GpuInstancesTest : public PictureTest<320, 200> {};

TEST_F(GpuInstancesTest, HasTheBitsOfTheCpuInRandomFrames) {
    TerrainRenderer renderer = make();
    const Result<internal::InstanceDevice*> device = renderer.instance_device();
    ASSERT_TRUE(device) << device.error().message;
    const MeshId cube = renderer.add_mesh(make_box_mesh({1.0, 1.0, 1.0}).value()).value();
    std::vector<ImpostorId> cubes;
    for (int i = 0; i < kMostModels; ++i)
        cubes.push_back(renderer.add_impostor(cube, {.texels = kTexels}).value());
    const std::uint64_t seed = 7;
    Random random(seed);
    std::size_t most = 0, none = 0, all = 0;
    for (int number = 0; number < kScenes; ++number) {
        SceneSettings settings;
        settings.fade_ratio = random.below(4) == 0 ? 1.0 : random.between(1.0, 2.0);
        const double spread = std::exp2(random.between(3.0, random.below(4) == 0 ? 30.0 : 12.0));
        if (random.below(3) == 0) settings.far_distance = spread * random.between(0.1, 2.0);
        Pair pair(settings, *device);
        std::vector<ModelId> models;
        for (int i = 1 + random.below(kMostModels); i > 0; --i) {
            ObjectModel model = random_model(random, static_cast<std::uint32_t>(models.size()));
            model.bounds.low = model.bounds.low.cwiseMin(model.bounds.high);
            if (random.below(3) > 0) {
                model.impostor = cubes[models.size()];
            } else {
                model.impostor = ImpostorId{static_cast<std::uint32_t>(1000 + models.size())};
            }
            models.push_back(pair.add(model));
        }
        const auto some_model = [&] {
            return models[static_cast<std::size_t>(random.below(static_cast<int>(models.size())))];
        };
        std::vector<NodeId> nodes;
        const auto add_nodes = [&](int count) {
            for (; count > 0; --count) {
                InstancesNode of_node{.model = some_model(), .objects = {}};
                const int kind = random.below(6);
                const int objects = kind == 0 ? 0 : kind == 1 ? 1 : 1 + random.below(1500);
                for (int i = 0; i < objects; ++i)
                    of_node.objects.push_back(random_object(random, spread));
                nodes.push_back(pair.add({}, of_node));
            }
        };
        add_nodes(random.below(5));
        for (int i = random.below(4); i > 0; --i) {
            NodePlace place;
            place.parent_from_node.translation = random_object(random, spread).position;
            pair.add(place, ModelNode{.model = some_model()});
        }
        for (int frame = 0; frame < kFrames; ++frame) {
            SCOPED_TRACE(testing::Message() << "seed " << seed << ", scene " << number << ", frame "
                                            << frame << ", spread " << spread);
            const View view = random_view(random, spread);
            const double least_px =
                random.below(3) == 0 ? 0.0 : std::exp2(random.between(-6.0, 6.0));
            const int kind = random.below(8);
            const double threshold_px = kind == 0   ? std::numeric_limits<double>::infinity()
                                        : kind == 1 ? 0.0
                                        : kind == 2 ? 1e6  // the coarsest levels
                                                    : std::exp2(random.between(-8.0, 6.0));
            const std::size_t instances =
                compare(pair, view, least_px, std::max(threshold_px, least_px), cubes);
            most = std::max(most, instances);
            none += instances == 0;
            if (HasFailure()) return;
            ++all;
            if (random.below(4) == 0 && !nodes.empty()) {
                pair.remove(nodes.back());
                nodes.pop_back();
                add_nodes(1);
            }
        }
    }
    EXPECT_EQ(all, static_cast<std::size_t>(kScenes * kFrames));
    EXPECT_GT(most, 500u);
    EXPECT_GT(none, all / 50);
    EXPECT_LT(none, 3 * all / 4);
}

// A device without memory: for objects, or for the groups of a frame.
class FullDevice final : public internal::InstanceDevice {
public:
    explicit FullDevice(bool takes_objects) : takes_objects_(takes_objects) {}
    void clear() override {}
    void add_model(const internal::DeviceModel&) override {}
    Result<std::uint32_t> add(std::span<const internal::DeviceObject>) override {
        ++refused;
        if (takes_objects_) return 0;
        return tl::unexpected(Error{ErrorCode::device_unavailable, "full"});
    }
    void remove(std::uint32_t, std::size_t) override {}
    Result<Culled> cull(const internal::DeviceFrame&) override {
        ++refused;
        return tl::unexpected(Error{ErrorCode::device_unavailable, "full"});
    }
    std::span<const std::uint32_t> factor_counts(std::uint32_t) override { return {}; }
    Chosen choose(float) override { return {}; }

    int refused = 0;

private:
    bool takes_objects_;
};

TEST_F(GpuInstancesTest, WithoutMemoryOnTheDeviceTheCpuChoosesTheLevels) {
    for (const bool takes_objects : {false, true}) {
        FullDevice device(takes_objects);
        Pair pair({}, &device);
        Random random(5);
        InstancesNode of_node{.model = pair.add(tree_model()), .objects = {}};
        for (int i = 0; i < 1000; ++i) of_node.objects.push_back(random_object(random, 100.0));
        pair.add({}, of_node);
        const View view = view_from({0, -150, 0}, {0, 0, 0});
        EXPECT_EQ(compare(pair, view, 0.0, 1.0, {}), 0u);
        EXPECT_GT(pair.gpu.counts().drawn, 500u);
        EXPECT_GT(device.refused, 0);
    }
}

TEST_F(GpuInstancesTest, WhatTheGroundHidesIsThatOfTheCpu) {
    TerrainRenderer renderer = make();
    Pair pair({}, renderer.instance_device().value());
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Random random(11);
    ObjectModel tree = tree_model();
    tree.impostor = ImpostorId{1000};
    InstancesNode of_node{.model = pair.add(tree), .objects = {}};
    for (int i = 0; i < 6000; ++i) {
        const double x = random.between(-1500.0, 1500.0), y = random.between(-1500.0, 1500.0);
        of_node.objects.push_back({.position = {x, y, source->height(x, y)}});
    }
    pair.add({}, of_node);
    HorizonMap horizon;
    std::size_t occluded = 0, drawn = 0;
    for (int frame = 0; frame < 8; ++frame) {
        SCOPED_TRACE(testing::Message() << "frame " << frame);
        const double x = random.between(-500.0, 500.0), y = random.between(-500.0, 500.0);
        const WorldPos eye(x, y, source->height(x, y) + random.between(3.0, 40.0));
        CameraNeed camera;
        camera.view = view_from(eye, eye + WorldPos(random.between(-1.0, 1.0), 1.0, -0.05));
        pager.update({&camera, 1}, {}, frame);
        pager.finish();
        horizon.build(pager.resident(), camera.view, {.refinable_px = 2.0, .finest_m = 0.5});
        ASSERT_TRUE(horizon.is_of(camera.view));
        drawn += compare(pair, camera.view, 1.0, 2.0, {}, &horizon);
        occluded += pair.gpu.counts().occluded;
    }
    EXPECT_GT(drawn, 500u);
    EXPECT_GT(occluded, 500u);
}

// Spheres with levels and impostors, with single ones between them.
TEST_F(GpuInstancesTest, DrawsThePicturesOfTheCpu) {
    TerrainRenderer renderer = make({.sample_count = 4});
    Pair pair({}, renderer.instance_device().value());
    Random random(3);
    std::vector<ModelId> models;
    for (const double radius : {1.0, 2.5}) {
        ObjectLevels levels = make_object_levels(make_sphere_mesh(radius).value()).value();
        ASSERT_TRUE(upload_levels(levels, {}, renderer).has_value());
        levels.model.continuous = nullptr;
        models.push_back(pair.add(levels.model));
        InstancesNode of_node{.model = models.back(), .objects = {}};
        for (int i = 0; i < 700; ++i) of_node.objects.push_back(random_object(random, 600.0));
        pair.add({}, of_node);
        for (int i = 0; i < 5; ++i) {
            NodePlace place;
            place.parent_from_node.translation = random_object(random, 50.0).position;
            pair.add(place, ModelNode{.model = models.back()});
        }
    }
    std::size_t small = 0, large = 0, meshes = 0;
    for (int frame = 0; frame < 12; ++frame) {
        const WorldPos eye = 50.0 * frame * random.direction();
        const View view = view_from(eye, 100.0 * random.direction());
        const double threshold_px = std::exp2(random.between(-2.0, 3.0));
        (void)pair.cpu.begin_frame(view);
        (void)pair.gpu.begin_frame(view);
        const SceneDraws draws = pair.cpu.end_frame(threshold_px);
        const SceneDraws of_device = pair.gpu.end_frame(threshold_px);
        ASSERT_NE(of_device.device, nullptr) << "frame " << frame;
        const Image expected = draw(renderer, view, draws);
        const std::size_t objects = renderer.counts().objects_drawn;
        const Image found = draw(renderer, view, of_device);
        EXPECT_EQ(renderer.counts().objects_drawn, objects);
        EXPECT_EQ(found.rgb, expected.rgb) << "frame " << frame;
        meshes += of_device.device_meshes.size();
        for (const ImpostorDraw& each : of_device.device_impostors) {
            const std::uint32_t of_draw = of_device.device->small_count(each.first_instance);
            small += of_draw;
            large += each.instance_count - of_draw;
        }
    }
    EXPECT_GT(meshes, 12u);
    EXPECT_GT(small, 100u);
    EXPECT_GT(large, 100u);
}

// Objects above a floor, some of them out of view.
TEST_F(GpuInstancesTest, CastsTheShadowsOfTheCpu) {
    RendererSettings settings;
    settings.shadow_distance = 600.0;
    TerrainRenderer renderer = make(settings);
    Pair pair({}, renderer.instance_device().value());
    Random random(5);
    ObjectLevels levels = make_object_levels(make_sphere_mesh(1.5).value()).value();
    ASSERT_TRUE(upload_levels(levels, {}, renderer).has_value());
    levels.model.continuous = nullptr;
    InstancesNode of_node{.model = pair.add(levels.model), .objects = {}};
    for (int i = 0; i < 900; ++i) of_node.objects.push_back(random_object(random, 120.0));
    pair.add({}, of_node);
    const Aabb bounds = {{-300.0, -300.0, -1.0}, {300.0, 300.0, 1.0}};
    const MeshId floor = renderer.add_mesh(make_box_mesh(bounds.high).value()).value();
    NodePlace below;
    below.parent_from_node.translation = {0.0, 0.0, -150.0};
    pair.add(below,
             ModelNode{.model = pair.add(plain_model(static_cast<std::uint32_t>(floor), bounds))});
    std::size_t casters = 0, changed = 0;
    for (int frame = 0; frame < 6; ++frame) {
        const View view = view_from(150.0 * random.direction() + WorldPos(0.0, 0.0, 100.0),
                                    {random.between(-50.0, 50.0), 0.0, -100.0});
        const double threshold_px = std::exp2(random.between(-2.0, 4.0));
        (void)pair.cpu.begin_frame(view, 0.0, renderer.shadows());
        (void)pair.gpu.begin_frame(view, 0.0, renderer.shadows());
        const SceneDraws draws = pair.cpu.end_frame(threshold_px);
        SceneDraws of_device = pair.gpu.end_frame(threshold_px);
        ASSERT_NE(of_device.device, nullptr) << "frame " << frame;
        const Image expected = draw(renderer, view, draws);
        const Image found = draw(renderer, view, of_device);
        EXPECT_EQ(found.rgb, expected.rgb) << "frame " << frame;
        casters += pair.gpu.counts().casters;
        of_device.device = nullptr;
        changed += draw(renderer, view, of_device).rgb != expected.rgb;
    }
    EXPECT_GT(casters, 100u);
    EXPECT_EQ(changed, 6u);
}

}  // namespace gpu_instances_test
}  // namespace terrane::test
