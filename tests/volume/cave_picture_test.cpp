// SPDX-License-Identifier: MIT
//
// Pictures of volumes: no gap shows the sky, and vertices on the heightfield have the bits of the heightfield's.
#include "render/render_scene.h"
#include "support/grounds.h"
#include "support/random.h"
#include "terrain/volume_draws.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <memory>
#include <set>

namespace terrane::cave_picture_test {

constexpr int kWidth = 640, kHeight = 360;
// A tunnel that winds deep below the ground, over the borders of chunks, closed at both ends.
const Eigen::Vector3d kPath[] = {{200.0, 380.0, -90.0},
                                 {300.0, 400.0, -95.0},
                                 {380.0, 390.0, -80.0},
                                 {390.0, 300.0, -80.0},
                                 {520.0, 250.0, -100.0}};

std::shared_ptr<const VolumeHeights> closed_tunnel(double extra_z = 0.0) {
    Lattice lattice{.finest_level = 3};
    VolumeTube tube{{}, 5.0};
    for (Eigen::Vector3d p : kPath) {
        p.z() += extra_z;
        tube.path_shape.push_back(p);
    }
    const auto volumes = Volumes::create(
        lattice, std::vector<VolumeOperation>{{.op = VolumeOp::remove, .shape = tube}},
        {.level = lattice.finest_level});
    return VolumeHeights::create(std::make_shared<const test::WaveHeights>(lattice, 30.0, 300.0),
                                 volumes.value())
        .value();
}

class CavePicture : public test::PictureTest<kWidth, kHeight> {};

/// Pixels of a sky that is magenta.
int count_sky(const Image& image) {
    int count = 0;
    for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3) {
        const bool is_magenta = image.rgb[i] > 2 * image.rgb[i + 1] + 40 &&
                                image.rgb[i + 2] > 2 * image.rgb[i + 1] + 40;
        count += is_magenta ? 1 : 0;
    }
    return count;
}

// From inside a closed tunnel every direction meets a wall, at every level of detail and on every border of chunks.
TEST_F(CavePicture, ShowsNoSkyThroughAGap) {
    const auto source = closed_tunnel();
    TerrainRenderer renderer = make({.sun_direction = {0.0, 0.0, -1.0},  // no glow in the sky
                                     .haze_distance = std::numeric_limits<double>::infinity(),
                                     .sample_count = 1,
                                     .horizon_colour = {1.0f, 0.0f, 1.0f},
                                     .zenith_colour = {1.0f, 0.0f, 1.0f}});
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 400'000}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const double step = 0.01 * test::few_or_many(16, 8);
    int frame = 0, drawn = 0;
    for (std::size_t leg = 0; leg + 1 < std::size(kPath); ++leg) {
        for (double t = 0.02; t < 1.0; t += step) {
            const WorldPos eye = kPath[leg] + t * (kPath[leg + 1] - kPath[leg]);
            const WorldPos ahead = eye + (kPath[leg + 1] - kPath[leg]).normalized() +
                                   Eigen::Vector3d(0.4 * std::sin(9.0 * t), 0.3 * std::cos(7.0 * t),
                                                   0.5 * std::sin(5.0 * t));
            const View view = view_from(eye, ahead, 1.3);
            CameraNeed camera{.view = view};
            pager.update({&camera, 1}, {}, 0.1 * frame);
            pager.finish();
            const TerrainMesh mesh = triangulator.update(pager.resident(), view);
            ASSERT_TRUE(renderer.draw(mesh, view)) << "frame " << frame;
            EXPECT_EQ(count_sky(renderer.read()), 0) << "frame " << frame;
            drawn += mesh.solids.empty() ? 0 : 1;
            ++frame;
        }
    }
    EXPECT_EQ(drawn, frame);
    // the count itself: a view of the sky
    const View up = view_from({0.0, 0.0, 500.0}, {0.0, 1.0, 600.0});
    ASSERT_TRUE(renderer.draw(triangulator.update(pager.resident(), up), up));
    EXPECT_EQ(count_sky(renderer.read()), kWidth * kHeight);
}

TEST(SolidVertices, OnSamplesHaveNoOffset) {
    const auto source = closed_tunnel(70.0);  // cuts the ground
    int on_samples = 0;
    for (int x = 1; x < 5; ++x) {
        for (int y = 1; y < 4; ++y) {
            const auto chunk = make_chunk(*source, {x, y, 3}).value();
            if (!chunk->solid) continue;
            const SolidTriangles& solid = chunk->solid->triangles();
            const auto vertices = internal::make_solid_vertices(source->lattice(), *chunk);
            std::set<std::uint32_t> kept;
            for (const auto& triangle : solid.kept_neighbours)
                kept.insert(triangle.begin(), triangle.end());
            for (const std::uint32_t i : kept) {
                const internal::SolidVertex& v = vertices[i];
                for (const float offset : v.offset) EXPECT_EQ(offset, 0.0f);
                EXPECT_EQ(v.height, chunk->heights[sample_index(v.column, v.row)]);
                ++on_samples;
            }
            for (std::size_t i = 0; i < vertices.size(); ++i) {
                const auto place = [&](std::int64_t corner, std::int32_t index) {
                    return corner + index * chunk->step;
                };
                const WorldPos back(
                    source->lattice().x(place(chunk->corner.x, vertices[i].column)) +
                        static_cast<double>(vertices[i].offset[0]),
                    source->lattice().y(place(chunk->corner.y, vertices[i].row)) +
                        static_cast<double>(vertices[i].offset[1]),
                    source->lattice().quantum * vertices[i].height +
                        static_cast<double>(vertices[i].offset[2]));
                EXPECT_LT((back - solid.vertices_world[i]).norm(), 1e-6);
            }
        }
    }
    EXPECT_GT(on_samples, 100);
}

}  // namespace terrane::cave_picture_test
