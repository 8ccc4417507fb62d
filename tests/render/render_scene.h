// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/offscreen.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace terrane::test {

/// A test with an OpenGL context that is current and checks calls; skipped where there is none.
class GlTest : public testing::Test {
protected:
    void SetUp() override {
        Result<GlContext> context = GlContext::create(GlChecks::on);
        if (!context) GTEST_SKIP() << context.error().message;
        context_ = std::make_unique<GlContext>(std::move(*context));
    }

    std::unique_ptr<GlContext> context_;
};

/// A test with renderers of one size.
template <int kWidth, int kHeight>
class PictureTest : public GlTest {
protected:
    TerrainRenderer make(const RendererSettings& settings = {}) {
        Result<TerrainRenderer> made =
            TerrainRenderer::create(*context_, kWidth, kHeight, settings);
        EXPECT_TRUE(made) << (made ? "" : made.error().message);
        return std::move(*made);
    }
    static View view_from(const WorldPos& eye, const WorldPos& target, double vertical_fov = 1.0) {
        return look_at(eye, target, vertical_fov, kWidth, kHeight).value();
    }
};

/// A solid of one colour, drawn as a mesh of a scene.
struct Solid {
    enum class Form { box, ellipsoid, cylinder };  ///< a cylinder is about z
    Form form = Form::box;
    Pose world_from_solid;
    Eigen::Vector3d extents = Eigen::Vector3d::Constant(0.5);  ///< half extents, metres
    Colour colour{0.8f, 0.2f, 0.1f};
};

/// The picture of a frame, also written to a folder that the environment variable TERRANE_PICTURES names.
Image draw(TerrainRenderer& renderer, const View& view, const SceneDraws& draws,
           const TerrainMesh& mesh = {});
/// The picture of ground and solids.
Image draw(TerrainRenderer& renderer, const TerrainMesh& mesh, const View& view,
           std::span<const Solid> solids = {});

ObjectInstance instance_at(const View& view, const WorldPos& place);

/// Red, green and blue of a pixel.
inline const std::uint8_t* pixel(const Image& image, int x, int y) {
    return &image.rgb[3 * static_cast<std::size_t>(y * image.width + x)];
}
inline int brightness(const Image& image, int x, int y) {
    const std::uint8_t* const rgb = pixel(image, x, y);
    return rgb[0] + rgb[1] + rgb[2];
}
inline bool is_same(const Image& a, const Image& b, int x, int y) {
    return std::equal(pixel(a, x, y), pixel(a, x, y) + 3, pixel(b, x, y));
}

/// A small world of hills, drawn without pager and triangulator: two adjacent roots of 256 m with samples 2 m apart,
/// and one chunk of level 1 (1 m) in the north-east quadrant of the western root. A strip of triangle fans in the chunk
/// joins it to the roots at vertices 2 m apart.
struct Scene {
    std::shared_ptr<const ResidentSet> resident;
    std::vector<MeshChunk> chunks;
    std::vector<std::uint16_t> indices;
    std::vector<std::vector<float>> offsets;  ///< storage of MeshChunk::offsets

    TerrainMesh mesh() const;
    double height(double x, double y) const;  ///< of the source
};

/// The world's west edge lies `roots_east` root squares (of 256 m) east of the origin.
Scene make_scene(std::int32_t roots_east = 0);

/// The same two roots with gentle hills and a roughness of 80 cm that only samples 1 m apart show.
///
/// @param resident resident chunks of level 1
/// @param drawn    subset of `resident` that draws its triangles; roots draw the rest
Scene make_rough_scene(std::span<const ChunkKey> resident, std::span<const ChunkKey> drawn);

/// Adds offsets of up to 2 m to the vertices of the western root and the fine chunk, except near the eastern root,
/// which does not morph. Offsets of unused samples are NaN.
void add_offsets(Scene& scene);
/// The offset that add_offsets() sets at a lattice point, counted from the south-west corner of the world.
float offset_at(std::int64_t x, std::int64_t y);

/// Number of pixels that differ by more than `more_than` in any channel.
int count_different(const Image& a, const Image& b, int more_than = 0);
/// Largest difference of any channel.
int largest_difference(const Image& a, const Image& b);

/// A world of two roots of 128 x 128 samples beside each other, on a plane.
///
/// @param height     at the edge between the roots, metres
/// @param slope_east rise over run
/// @param spacing    of the samples, metres
/// @param roots_east roots between the origin and the world's west edge
Scene make_plane_scene(double height = 0.0, double slope_east = 0.0, double spacing = 2.0,
                       std::int32_t roots_east = 0);

/// Raises the western root's triangles as a whole by offsets: a sheet above x = 0 to 256.
void raise_western_root(Scene& scene, float by);

}  // namespace terrane::test
