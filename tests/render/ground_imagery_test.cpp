// SPDX-License-Identifier: MIT
#include "render/render_scene.h"
#include "terrain/imagery_squares.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace terrane {
namespace ground_imagery_test {

using test::brightness;
using test::count_different;
using test::largest_difference;
using test::make_plane_scene;
using test::Scene;

constexpr int kWidth = 320, kHeight = 240;
constexpr double kField = 16.0;  // metres

// A chessboard of fields of 16 m between x = 160 to 352 and y = 80 to 176, white where the sum of the fields is even.
class Chessboard final : public ImagerySource {
public:
    WorldRect rect() const override { return {160.0, 80.0, 352.0, 176.0}; }
    double texel_size() const override { return 0.5; }
    static bool is_white(double x, double y) {
        return static_cast<long>(std::floor(x / kField) + std::floor(y / kField)) % 2 == 0;
    }
    Result<void> read(const WorldRect& square, int side,
                      std::span<ImageryTexel> texels_out) const override {
        while (is_held) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        if (throws) throw std::runtime_error("the chessboard is broken");
        if (fails) return fail(ErrorCode::io, "the chessboard is broken");
        const double texel = (square.east - square.west) / side;
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                const double x = square.west + (column + 0.5) * texel;
                const double y = square.south + (row + 0.5) * texel;
                const auto value = static_cast<std::uint8_t>(is_white(x, y) ? 220 : 30);
                const auto opacity = static_cast<std::uint8_t>(rect().contains(x, y) ? 255 : 0);
                texels_out[static_cast<std::size_t>(row * side + column)] = {value, value, value,
                                                                             opacity};
            }
        }
        return {};
    }

    std::atomic<bool> is_held = false, fails = false, throws = false;
};

// A metre is a pixel; the middle of the picture is x = 256, y = 128.
View view_down() {
    const double height = kHeight / (2.0 * std::tan(0.15));
    return *look_at({256.0, 128.0, height}, {256.0, 128.0, 0.0}, 0.3, kWidth, kHeight);
}

class GroundImageryTest : public test::PictureTest<kWidth, kHeight> {
protected:
    TerrainRenderer make(std::shared_ptr<const ImagerySource> imagery, bool waits,
                         std::size_t bytes = std::size_t{64} << 20) {
        return PictureTest::make({.sample_count = 1,
                                  .imagery = std::move(imagery),
                                  .imagery_bytes = bytes,
                                  .imagery_waits = waits});
    }
    static Image draw(TerrainRenderer& renderer, const Scene& scene) {
        return test::draw(renderer, scene.mesh(), view_down());
    }
};

TEST_F(GroundImageryTest, LiesWhereItsSourceSaysAndLeavesTheRest) {
    const Scene scene = make_plane_scene();
    TerrainRenderer bare = make(nullptr, true);
    const Image without = draw(bare, scene);
    const auto source = std::make_shared<Chessboard>();
    TerrainRenderer renderer = make(source, true);
    const Image with = draw(renderer, scene);
    EXPECT_GT(renderer.counts().imagery_squares, 0u);
    int beside = 0, white = 0, black = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const double east = 256.0 + x + 0.5 - 0.5 * kWidth;
            const double north = 128.0 - (y + 0.5 - 0.5 * kHeight);
            // two pixels for the filter around the edges of fields
            const auto is_near = [](double place) {
                return std::abs(place / kField - std::round(place / kField)) < 2.5 / kField;
            };
            if (is_near(east) || is_near(north)) continue;
            SCOPED_TRACE(testing::Message() << east << ", " << north);
            if (!source->rect().contains(east, north)) {
                ASSERT_EQ(brightness(with, x, y), brightness(without, x, y));
                ++beside;
            } else if (Chessboard::is_white(east, north)) {
                ASSERT_GT(brightness(with, x, y), 540);
                ++white;
            } else {
                ASSERT_LT(brightness(with, x, y), 140);
                ++black;
            }
        }
    }
    EXPECT_GT(std::min({beside, white, black}), kWidth * kHeight / 50);
}

TEST_F(GroundImageryTest, AFrameDoesNotWaitForItsSourceAndFadesTheAnswerIn) {
    const Scene scene = make_plane_scene();
    TerrainRenderer bare = make(nullptr, true);
    const Image without = draw(bare, scene);
    const auto source = std::make_shared<Chessboard>();
    TerrainRenderer waiting = make(source, true);
    const Image with = draw(waiting, scene);
    source->is_held = true;
    TerrainRenderer renderer = make(source, false);
    for (int frame = 0; frame < 3; ++frame)
        EXPECT_EQ(count_different(draw(renderer, scene), without), 0);
    source->is_held = false;
    Image last = without;
    int largest_step = 0, frames = 0;
    for (; frames < 2000 && largest_difference(last, with) > 2; ++frames) {
        const Image next = draw(renderer, scene);
        largest_step = std::max(largest_step, largest_difference(last, next));
        last = next;
    }
    EXPECT_LE(largest_difference(last, with), 2);
    // two levels of squares fade in together
    EXPECT_LT(largest_step, largest_difference(without, with) / 3);
    EXPECT_GE(frames, 12);
}

// Squares of the world before are dropped; a read that has begun is not waited for.
TEST_F(GroundImageryTest, AnotherWorldDoesNotWaitForItsSource) {
    const Scene scene = make_plane_scene();
    const Scene other = test::make_scene(40);
    ASSERT_FALSE(scene.resident->lattice() == other.resident->lattice());
    const auto source = std::make_shared<Chessboard>();
    source->is_held = true;
    TerrainRenderer renderer = make(source, false);
    draw(renderer, scene);
    draw(renderer, other);  // would wait without end
    draw(renderer, scene);
    source->is_held = false;
    TerrainRenderer waiting = make(source, true);
    const Image with = draw(waiting, scene);
    for (int frame = 0; frame < 2000; ++frame) {
        if (largest_difference(draw(renderer, scene), with) <= 2) return;
    }
    FAIL() << "the squares have not come";
}

TEST(ImageryLoader, EndsAfterTheSquareThatIsBeingRead) {
    struct Counted final : ImagerySource {
        WorldRect rect() const override { return {0.0, 0.0, 1.0, 1.0}; }
        double texel_size() const override { return 1.0; }
        Result<void> read(const WorldRect&, int, std::span<ImageryTexel>) const override {
            ++reads;
            while (is_held) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            return {};
        }
        mutable std::atomic<int> reads = 0;
        std::atomic<bool> is_held = true;
    };
    const auto source = std::make_shared<Counted>();
    std::optional<internal::ImageryLoader> loader(source);
    std::vector<internal::ImageryRequest> wanted;
    for (int x = 0; x < 8; ++x) wanted.push_back({{.level = 3, .y = 0, .x = x}, {}});
    loader->request(std::move(wanted));
    while (source->reads == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::jthread release([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        source->is_held = false;
    });
    loader.reset();
    EXPECT_LE(source->reads, 2);
}

TEST_F(GroundImageryTest, ShowsCoarseSquaresWhereMemoryIsShort) {
    const Scene scene = make_plane_scene();
    const auto source = std::make_shared<Chessboard>();
    TerrainRenderer renderer = make(source, true, 1);
    draw(renderer, scene);
    EXPECT_EQ(renderer.counts().imagery_squares, 1u);
    const std::size_t one = renderer.buffer_bytes();
    TerrainRenderer two = make(source, true, 700'000);
    draw(two, scene);
    EXPECT_EQ(two.counts().imagery_squares, 2u);
    EXPECT_EQ(two.buffer_bytes() - one, 4u * (256 * 256 + 128 * 128 + 64 * 64));
}

TEST_F(GroundImageryTest, CountsFailedSquaresAndShowsTheTints) {
    const Scene scene = make_plane_scene();
    TerrainRenderer bare = make(nullptr, true);
    for (const bool throws : {false, true}) {
        const auto source = std::make_shared<Chessboard>();
        source->fails = !throws;
        source->throws = throws;
        TerrainRenderer renderer = make(source, true);
        EXPECT_EQ(count_different(draw(renderer, scene), draw(bare, scene)), 0);
        const std::size_t failures = renderer.counts().imagery_failures;
        EXPECT_GT(failures, 0u);
        draw(renderer, scene);
        EXPECT_EQ(renderer.counts().imagery_failures, failures);  // they are not read again
    }
}

TEST(SelectImagery, GivesEverySquareAfterItsParentAndTexelsForThePixelsInView) {
    using namespace internal;
    const Scene scene = make_plane_scene();
    const Lattice& lattice = scene.resident->lattice();
    const double texel_size = 0.01;
    int finer = 0, shown = 0;
    for (int i = 0; i < 12; ++i) {
        const WorldPos eye(100.0 + 30.0 * i, 100.0, 1.0 + i * i);
        const View view = *look_at(eye, {256.0, 110.0, 0.0}, 1.0, kWidth, kHeight);
        const WorldRect rect{0.0, 0.0, 512.0, 256.0};
        const auto squares = select_imagery(*scene.resident, view, rect, texel_size, 10'000);
        std::set<ImagerySquare> known;
        for (const ImagerySquare& square : squares) {
            ASSERT_TRUE(known.insert(square).second);
            if (square.level == 0) continue;
            ASSERT_TRUE(known.contains({square.level - 1, square.y >> 1, square.x >> 1}));
            ++finer;
        }
        // the finest square of every point that a pixel shows has texels as small as the pixel
        for (int pixel = 0; pixel < 200; ++pixel) {
            const double scale = std::tan(0.5 * view.vertical_fov) / (0.5 * kHeight);
            const int x = pixel % 20 * 16, y = pixel / 20 * 24;
            const Eigen::Vector3d ray = view.forward + scale * (x - 0.5 * kWidth) * view.right() -
                                        scale * (y - 0.5 * kHeight) * view.up;
            if (ray.z() >= 0.0) continue;
            const WorldPos p = eye - ray * (eye.z() / ray.z());
            if (!rect.contains(p.x(), p.y())) continue;
            ++shown;
            double texel = 1e30;
            for (const ImagerySquare& square : squares) {
                if (imagery_rect(lattice, square).contains(p.x(), p.y()))
                    texel = std::min(texel, imagery_side(lattice, square.level) / kImageryContent);
            }
            ASSERT_LE(texel, std::max((p - eye).norm() / view.pixels_per_radian(), texel_size));
        }
        EXPECT_EQ(select_imagery(*scene.resident, view, rect, texel_size, 5).size(), 5u);
    }
    EXPECT_GT(finer, 100);
    EXPECT_GT(shown, 500);
}

TEST(ImageryTexture, AveragesColoursByTheirOpacity) {
    using namespace internal;
    std::vector<ImageryTexel> texels(std::size_t{kImageryTexels} * kImageryTexels);
    // of four texels one is opaque
    for (std::size_t i = 0; i < texels.size(); ++i) {
        const bool is_there = i % 2 == 0 && i / kImageryTexels % 2 == 0;
        texels[i] = is_there ? ImageryTexel{200, 100, 40, 255} : ImageryTexel{9, 9, 9, 0};
    }
    const ImageryTexture made = make_imagery_texture(texels);
    EXPECT_EQ(made.mipmaps[0][0], (ImageryTexel{200, 100, 40, 255}));
    EXPECT_EQ(made.mipmaps[0][1], (ImageryTexel{0, 0, 0, 0}));
    for (std::size_t mipmap : {1u, 2u}) {
        EXPECT_EQ(made.mipmaps[mipmap].size(), texels.size() >> 2 * mipmap);
        for (const ImageryTexel& texel : made.mipmaps[mipmap])
            ASSERT_EQ(texel, (ImageryTexel{50, 25, 10, 64}));
    }
}

}  // namespace ground_imagery_test
}  // namespace terrane
