// SPDX-License-Identifier: MIT
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

namespace terrane::terrain_test {

std::shared_ptr<const HeightSource> hills() {
    return FractalHeights::create({.seed = 4,
                                   .octave_count = 8,
                                   .amplitude = 120.0,
                                   .wavelength_log2 = 9,
                                   .finest_spacing_log2 = 0,
                                   .root_size_log2 = 10})
        .value();
}

TerrainSettings synchronous(std::size_t budget) {
    return {.paging = {.worker_count = 0}, .meshes = {.triangle_budget = budget}};
}

View view_from(double x, double y) {
    return look_at({x, y, 200.0}, {x + 500.0, y + 300.0, 0.0}, 1.0, 1280, 720).value();
}

// What a frame of the parts is, written out: the reference of Terrain.
TEST(Terrain, GivesTheFramesOfItsPartsWithTheirFeedbackOfThresholds) {
    const auto source = hills();
    const TerrainSettings settings = synchronous(20'000);
    Terrain terrain = Terrain::create(source, settings).value();
    Pager pager = Pager::create(source, settings.paging).value();
    Triangulator triangulator = Triangulator::create(*source, settings.meshes).value();
    double threshold_px = settings.meshes.max_error_px;
    std::size_t triangles = 0;
    for (int i = 0; i < 20; ++i) {
        const View view = view_from(-200.0 + 20.0 * i, 50.0);
        const BodyNeed body{.centre_world = {10.0 * i, 0.0, 0.0}, .radius = 2.0};
        const Frame& frame =
            terrain.update({{.view = view, .velocity = {400.0, 0.0, 0.0}}}, {&body, 1}, i / 20.0);
        pager.update({{.view = view, .velocity = {400.0, 0.0, 0.0}, .threshold_px = threshold_px}},
                     {&body, 1}, i / 20.0);
        const TerrainMesh mesh = triangulator.update(pager.resident(), view);
        threshold_px = mesh.threshold_px;
        ASSERT_EQ(frame.meshes.size(), 1u);
        ASSERT_EQ(frame.meshes[0].triangle_count, mesh.triangle_count) << "frame " << i;
        ASSERT_EQ(frame.meshes[0].error_px, mesh.error_px);
        ASSERT_EQ(frame.meshes[0].indices.size(), mesh.indices.size());
        ASSERT_EQ(std::memcmp(frame.meshes[0].indices.data(), mesh.indices.data(),
                              mesh.indices.size_bytes()),
                  0);
        ASSERT_EQ(frame.ground.height(10.0 * i, 0.0).height,
                  pager.ground().height(10.0 * i, 0.0).height);
        ASSERT_EQ(terrain.pager().stats().loaded, pager.stats().loaded)
            << "without feedback it loads more";
        triangles += mesh.triangle_count;
    }
    EXPECT_GT(triangles, 20u * 1000u) << "the frames were drawn";
}

TEST(Terrain, SharesTheBudgetOfACamerasMeshWithTheDemandsOfThatCamera) {
    const auto source = hills();
    const TerrainSettings settings = synchronous(5000);
    Terrain terrain = Terrain::create(source, settings).value();
    const std::vector<TriangleDemand> demands{
        {std::numeric_limits<double>::infinity(), 1000}, {100.0, 500}, {1e-3, 10'000}};
    const View view = view_from(0.0, 0.0);
    const std::vector<Camera> cameras{{.view = view}, {.view = view, .demands = demands}};
    const Frame& frame = terrain.load(cameras, {}, 0.0);
    Triangulator triangulator = Triangulator::create(*source, settings.meshes).value();
    const TerrainMesh mesh = triangulator.update(terrain.pager().resident(), view, demands);
    EXPECT_EQ(frame.meshes[0].demand_triangles, 0u);
    EXPECT_EQ(frame.meshes[1].demand_triangles, 1500u);
    EXPECT_EQ(frame.meshes[1].triangle_count, mesh.triangle_count);
    EXPECT_EQ(frame.meshes[1].demand_threshold_px, mesh.demand_threshold_px);
    EXPECT_LE(frame.meshes[1].triangle_count + 1500, 5000u);
    EXPECT_LT(frame.meshes[1].triangle_count, frame.meshes[0].triangle_count);
}

TEST(Terrain, MakesAMeshForEachCameraInItsOrderAndNoneBeforeTheFirstUpdate) {
    Terrain terrain = Terrain::create(hills(), synchronous(5000)).value();
    EXPECT_TRUE(terrain.frame().meshes.empty());
    EXPECT_EQ(terrain.frame().ground.height(0.0, 0.0).status, QueryStatus::not_resident);
    const std::vector<Camera> cameras{{.view = view_from(0.0, 0.0)},
                                      {.view = view_from(-300.0, 100.0)},
                                      {.view = view_from(200.0, -200.0)}};
    const Frame& frame = terrain.load(cameras, {}, 0.0);
    ASSERT_EQ(frame.meshes.size(), 3u);
    for (const TerrainMesh& mesh : frame.meshes) {
        EXPECT_GT(mesh.triangle_count, 100u);
        EXPECT_LE(mesh.triangle_count, 5000u);
    }
    EXPECT_NE(frame.meshes[0].error_px, frame.meshes[1].error_px);
    EXPECT_NE(frame.meshes[1].error_px, frame.meshes[2].error_px);
    EXPECT_TRUE(terrain.update({}, {}, 0.1).meshes.empty());
}

TEST(Terrain, LoadsTheGroundOfBodiesAndKeepsItsSnapshotWhenTheTerrainIsGone) {
    const auto source = hills();
    std::optional<Ground> kept;
    {
        Terrain terrain = Terrain::create(source, synchronous(5000)).value();
        const BodyNeed body{.centre_world = {100.0, 50.0, 0.0}, .radius = 3.0};
        kept = terrain.load({}, {&body, 1}, 0.0).ground;
        EXPECT_EQ(terrain.frame().groundless_bodies, 0u);
    }
    const HeightAnswer at = kept->height(100.0, 50.0);
    ASSERT_EQ(at.status, QueryStatus::ok);
    EXPECT_NEAR(at.height, source->height(100.0, 50.0), at.error_m);
}

TEST(Terrain, RefusesSettingsThatItsPartsRefuse) {
    EXPECT_NE(Terrain::create(nullptr).error().message.find("source"), std::string::npos);
    TerrainSettings settings = synchronous(5000);
    settings.meshes.max_error_px = -1.0;
    EXPECT_NE(Terrain::create(hills(), settings).error().message.find("max_error_px"),
              std::string::npos);
    settings = synchronous(5000);
    settings.paging.horizon = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(Terrain::create(hills(), settings).error().message.find("horizon"),
              std::string::npos);
}

TEST(RequiredRegion, KeepsGroundWhileItLivesAndMayOutliveThePager) {
    RequiredRegion region;
    EXPECT_EQ(region.state(), RegionState::released);
    {
        Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
        region = pager.require({10.0, 10.0, 20.0, 20.0}, 0.0);
        EXPECT_EQ(region.state(), RegionState::loading);
        pager.update({}, {}, 0.0);
        EXPECT_TRUE(region.is_ready());
        const Pager moved = std::move(pager);
        EXPECT_TRUE(region.is_ready()) << "it follows the pager";
        RequiredRegion other = std::move(region);
        EXPECT_TRUE(other.is_ready());
        EXPECT_FALSE(region.is_ready());  // NOLINT(bugprone-use-after-move): it requires nothing
        region = std::move(other);
    }
    EXPECT_EQ(region.state(), RegionState::released);
    region.release();
}

// The pixel of a world point by the matrices, as a vertex shader and the rasterizer find it.
Eigen::Vector2d pixel_of(const View& view, const std::array<float, 16>& projection,
                         const WorldPos& point_world) {
    const auto apply = [](const std::array<float, 16>& matrix, const Eigen::Vector4d& v) {
        Eigen::Vector4d out = Eigen::Vector4d::Zero();
        for (std::size_t column = 0; column < 4; ++column) {
            for (std::size_t row = 0; row < 4; ++row)
                out[static_cast<int>(row)] +=
                    static_cast<double>(matrix[4 * column + row]) * v[static_cast<int>(column)];
        }
        return out;
    };
    const Eigen::Vector3d offset = point_world - view.eye_world;
    const Eigen::Vector4d clip =
        apply(projection, apply(view.view_matrix(), {offset.x(), offset.y(), offset.z(), 1.0}));
    return {(clip.x() / clip.w() + 1.0) / 2.0 * view.width_px,
            (1.0 - clip.y() / clip.w()) / 2.0 * view.height_px};
}

TEST(View, HasMatricesThatProjectAPointToThePixelWhoseDirectionMeetsIt) {
    const View view =
        look_at({1e7, -3e6, 400.0}, {1e7 + 80.0, -3e6 + 50.0, 370.0}, 0.9, 1600, 900).value();
    for (const double far_plane : {5000.0, std::numeric_limits<double>::infinity()}) {
        const auto projection = view.projection_matrix(0.5, far_plane);
        for (const double x : {0.0, 100.5, 800.0, 1599.0}) {
            for (const double y : {0.0, 450.0, 899.5}) {
                const WorldPos point = view.eye_world + 700.0 * direction_through(view, x, y);
                const Eigen::Vector2d pixel = pixel_of(view, projection, point);
                EXPECT_NEAR(pixel.x(), x, 1e-2);
                EXPECT_NEAR(pixel.y(), y, 1e-2);
            }
        }
        // depth -1 at the near plane
        EXPECT_NEAR(projection[10] * -0.5 + projection[14], -0.5, 1e-6);
    }
}

}  // namespace terrane::terrain_test
