// SPDX-License-Identifier: MIT
#include "culling/horizon_rows.h"
#include "scene/scene_cases.h"
#include "support/random.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/function_heights.h>
#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace terrane::internal::sectors_test {
namespace {

using test::Random;

TEST(Sectors, AzimuthIncreasesWithTheAngle) {
    double last = -1.0;
    for (int i = 0; i < 100'000; ++i) {
        const double angle = 2.0 * 3.14159265358979 * i / 100'000;
        const double azimuth = azimuth_of(std::cos(angle), std::sin(angle));
        ASSERT_GT(azimuth, last) << i;
        ASSERT_LE(azimuth, kSectors) << i;
        last = azimuth;
    }
    EXPECT_EQ(azimuth_of(2.0, 0.0), 0.0);
    EXPECT_EQ(azimuth_of(0.0, 2.0), kSectors / 4);
    EXPECT_EQ(azimuth_of(-2.0, 0.0), kSectors / 2);
    EXPECT_EQ(azimuth_of(0.0, -2.0), kSectors * 3 / 4);
}

// Whether a ray from the eye crosses a rectangle, by slabs.
bool meets(const EyeRect& rect, double x, double y) {
    double least = 0.0, most = std::numeric_limits<double>::infinity();
    const auto slab = [&](double d, double low, double high) {
        if (d == 0.0) {
            if (low > 0.0 || high < 0.0) most = -1.0;
            return;
        }
        least = std::max(least, std::min(low / d, high / d));
        most = std::min(most, std::max(low / d, high / d));
    };
    slab(x, rect.west, rect.east);
    slab(y, rect.south, rect.north);
    return least <= most;
}

TEST(Sectors, OfARectangleTouchAllOfItsDirectionsAndCoverNoOthers) {
    constexpr std::uint64_t kSeed = 5;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    int covered_count = 0;
    for (int i = 0; i < 3000; ++i) {
        const double size = std::exp2(random.between(-4.0, 6.0));
        EyeRect rect;
        rect.west = random.between(-50.0, 50.0);
        rect.south = random.below(8) == 0 ? 0.0 : random.between(-50.0, 50.0);
        rect.east = rect.west + size;
        rect.north = rect.south + size;
        if (rect.contains_eye()) continue;
        const SectorRange touched = rect.wedge().touched(), covered = rect.wedge().covered();
        covered_count += covered.count;
        ASSERT_LE(covered.count, touched.count);
        std::array<bool, kSectors> is_touched{}, is_covered{};
        touched.visit([&](std::size_t sector) { is_touched[sector] = true; });
        covered.visit([&](std::size_t sector) { is_covered[sector] = true; });
        for (int k = 0; k < 500; ++k) {
            // half of them towards the rectangle
            Eigen::Vector3d to = random.direction();
            if (k % 2 == 0)
                to = {random.between(rect.west, rect.east), random.between(rect.south, rect.north),
                      0.0};
            const auto sector = static_cast<std::size_t>(azimuth_of(to.x(), to.y())) % kSectors;
            const bool is_met = meets(rect, to.x(), to.y());
            ASSERT_TRUE(!is_met || is_touched[sector]) << i;
            ASSERT_TRUE(is_met || !is_covered[sector]) << i;
        }
    }
    EXPECT_GT(covered_count, 10'000);
}

TEST(Sectors, RingsIncreaseWithTheDistanceAndBeginAtTheirBoundaries) {
    EXPECT_EQ(ring_of(0.0), 0);
    EXPECT_EQ(ring_of(std::nextafter(2.0, 0.0)), 0);
    EXPECT_EQ(ring_of(2.0), 1);
    EXPECT_EQ(ring_of(4.0), 1 + kRingsPerOctave);
    EXPECT_EQ(ring_of(std::nextafter(4.0, 0.0)), kRingsPerOctave);
    EXPECT_EQ(ring_of(131072.0), kRings - 1);
    EXPECT_EQ(ring_of(std::nextafter(131072.0, 0.0)), kRings - 2);
    EXPECT_EQ(ring_of(std::numeric_limits<double>::infinity()), kRings - 1);
    int last = 0;
    for (double distance = 0.5; distance < 1e6; distance *= 1.001) {
        ASSERT_GE(ring_of(distance), last);
        last = ring_of(distance);
    }
}

}  // namespace
}  // namespace terrane::internal::sectors_test

namespace terrane::test::horizon_map {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Hills with any resident chunks.
struct RandomFrame {
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const ResidentSet> resident;
    View view;
};

RandomFrame random_frame(Random& random) {
    RandomFrame frame;
    const FractalKind kinds[] = {FractalKind::fbm, FractalKind::ridged, FractalKind::hybrid};
    frame.source = FractalHeights::create({.seed = random.bits(),
                                           .kind = kinds[random.below(3)],
                                           .octave_count = 7,
                                           .amplitude = random.between(40.0, 400.0),
                                           .wavelength_log2 = 10,
                                           .finest_spacing_log2 = 2,
                                           .root_size_log2 = 10})
                       .value();
    const double share = random.between(0.3, 1.2);
    frame.resident = resident_chunks(*frame.source, 1, [&](const ChunkKey& key) {
        return key.level == 0 || random.between(0.0, 1.0) < share;
    });
    const double x = random.between(-900.0, 900.0), y = random.between(-900.0, 900.0);
    const double above = std::exp2(random.between(2.0, 8.0));
    const double turn = random.between(0.0, 6.28);
    const double roll = random.below(2) == 0 ? 0.0 : random.between(-1.0, 1.0);
    frame.view = view_along({x, y, frame.source->height(x, y) + above},
                            {std::cos(turn), std::sin(turn)}, random.between(-0.8, 0.3), roll);
    frame.view.vertical_fov = random.between(0.3, 1.5);
    frame.view.height_px = 100 + random.below(1000);
    return frame;
}

// Balls on the ground, above and partly below it; wide ones among them.
BoundingSphere random_ball(Random& random, const HeightSource& source, double extent) {
    const double x = random.between(-extent, extent), y = random.between(-extent, extent);
    const double radius = std::exp2(random.between(-2.0, 6.0));
    return {{x, y, source.height(x, y) + radius * random.between(-0.5, 1.5)}, radius};
}

TEST(HorizonMap, NothingHiddenIsInSightOverTheFinestSurfaceLoweredByTheError) {
    constexpr std::uint64_t kSeed = 7;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    int hidden = 0, impossible = 0;
    for (int state = 0; state < 20; ++state) {
        RandomFrame frame = random_frame(random);
        const double error_px = random.between(0.0, 20.0);
        HorizonMap horizon;
        horizon.build(frame.resident, frame.view, {.refinable_px = error_px});
        const Ground finest(resident_chunks(*frame.source, 1), 1);
        const WorldPos& eye = frame.view.eye_world;
        const double error = error_px / frame.view.pixels_per_radian();
        for (int i = 0; i < 300; ++i) {
            const BoundingSphere ball = random_ball(random, *frame.source, 1000.0);
            // a box that a group of such balls might have
            const Aabb box = {ball.centre - random.between(0.0, 60.0) * Eigen::Vector3d::Ones(),
                              ball.centre + random.between(0.0, 60.0) * Eigen::Vector3d::Ones()};
            const bool is_possible = horizon.may_hide_in(box);
            impossible += is_possible ? 0 : 1;
            if (!horizon.hides(ball)) continue;
            EXPECT_TRUE(is_possible) << "state " << state << " ball " << i;
            for (int k = 0; k < 8; ++k) {
                const std::optional<WorldPos> p = shown_point(random, frame.view, ball);
                if (!p) continue;
                // a surface lowered in proportion to the distance meets a ray where the surface itself meets the ray
                // that is raised so; 0.1 m is the error of the finest triangles here
                const double distance = (*p - eye).norm();
                const WorldPos raised = *p + Eigen::Vector3d(0.0, 0.0, error * distance);
                const RayAnswer answer = finest.ray(eye, raised);
                ASSERT_EQ(answer.status, QueryStatus::ok) << "state " << state << " ball " << i;
                ++hidden;
            }
        }
    }
    EXPECT_GT(hidden, 1000);
    EXPECT_GT(impossible, 100);
}

// A wall from x = 500 to 600, 50 m high, with slopes beside it, over a plane at height 0.
double wall_height(double x, double) {
    const double beside = std::max({450.0 - x, x - 650.0, 0.0});
    if (beside > 0.0) return 0.0;
    return 50.0 * std::clamp(std::min(x - 450.0, 650.0 - x) / 50.0, 0.0, 1.0);
}

std::shared_ptr<const HeightSource> wall_source() {
    const Lattice lattice = {
        .origin_x = -1024.0, .origin_y = -1024.0, .spacing = 4.0, .finest_level = 2};
    return heights_from_function(wall_height, {.extent = {-1024.0, -1024.0, 1024.0, 1024.0},
                                               .finest_spacing = lattice.spacing,
                                               .lattice = lattice,
                                               .slope = 1.0,
                                               .range = HeightInterval{0.0, 50.0}})
        .value();
}

View eastward() { return view_along({0.0, 3.0, 10.0}, {1.0, 0.0}, 0.0, 0.0); }

class HorizonOfAWall : public testing::Test {
protected:
    HorizonOfAWall()
        : source(wall_source()),
          resident(resident_chunks(*source, source->lattice().finest_level)) {}

    bool hides(const std::shared_ptr<const ResidentSet>& set, const View& view,
               const BoundingSphere& ball, double error_px = 1.0) {
        horizon.build(set, view, {.refinable_px = error_px});
        return horizon.hides(ball);
    }

    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const ResidentSet> resident;
    HorizonMap horizon;
    BoundingSphere behind{{900.0, 20.0, 5.0}, 5.0};
};

TEST_F(HorizonOfAWall, HidesWhatIsBehindItAndLower) {
    EXPECT_TRUE(hides(resident, eastward(), behind));
    EXPECT_TRUE(horizon.is_of(eastward()));
    EXPECT_FALSE(horizon.hides(BoundingSphere{{900.0, 20.0, 80.0}, 20.0})) << "higher";
    EXPECT_FALSE(horizon.hides(BoundingSphere{{400.0, 20.0, 5.0}, 5.0})) << "in front";
    EXPECT_FALSE(horizon.hides(BoundingSphere{{520.0, 20.0, 5.0}, 60.0})) << "around it";
    EXPECT_FALSE(horizon.hides(BoundingSphere{eastward().eye_world, 5.0})) << "at the eye";
    EXPECT_FALSE(horizon.hides(BoundingSphere{{900.0, 20.0, 0.0}, 2000.0})) << "around the eye";
}

TEST_F(HorizonOfAWall, ALargerErrorHidesLess) {
    const BoundingSphere high{{900.0, 20.0, 45.0}, 5.0};
    EXPECT_TRUE(hides(resident, eastward(), high, 1.0));
    EXPECT_FALSE(hides(resident, eastward(), high, 30.0));
    EXPECT_TRUE(hides(resident, eastward(), behind, 30.0));
}

TEST_F(HorizonOfAWall, HidesNothingAtTheUpperEdgeOfThePicture) {
    View view = eastward();
    view.forward =
        Eigen::Vector3d(1.0, 0.0, -0.5773502691896258).normalized();  // its edge is level
    view.up = Eigen::Vector3d(0.5773502691896258, 0.0, 1.0).normalized();
    view.eye_world.z() = 20.0;
    EXPECT_FALSE(hides(resident, view, {{900.0, 20.0, 15.0}, 5.0}));
    EXPECT_TRUE(hides(resident, view, {{900.0, 20.0, 5.0}, 5.0}));
}

TEST_F(HorizonOfAWall, HidesNothingForInputThatIsNotFinite) {
    const BoundingSphere balls[] = {{{kNaN, 20.0, 5.0}, 5.0},       {{900.0, kNaN, 5.0}, 5.0},
                                    {{900.0, 20.0, kNaN}, 5.0},     {{900.0, 20.0, 5.0}, kNaN},
                                    {{kInfinite, 20.0, 5.0}, 5.0},  {{900.0, 20.0, 5.0}, kInfinite},
                                    {{900.0, 20.0, kInfinite}, 5.0}};
    for (const BoundingSphere& ball : balls) EXPECT_FALSE(hides(resident, eastward(), ball));
    EXPECT_FALSE(horizon.hides(Aabb{{kNaN, 0.0, 0.0}, {900.0, 1.0, 1.0}}));
    for (const double error_px : {kNaN, kInfinite, -1.0, 1e6})
        EXPECT_FALSE(hides(resident, eastward(), behind, error_px)) << error_px;
    View view = eastward();
    view.eye_world.x() = kNaN;
    EXPECT_FALSE(hides(resident, view, behind));
    EXPECT_FALSE(horizon.is_of(view));
    EXPECT_FALSE(hides(nullptr, eastward(), behind));
}

TEST_F(HorizonOfAWall, HidesNothingForAnEyeInOrBelowOrBesideTheGround) {
    for (const double z : {-1e6, -10.0, 0.0, 0.5}) {
        View view = eastward();
        view.eye_world.z() = z;
        EXPECT_FALSE(hides(resident, view, behind)) << z;
    }
    View inside = eastward();
    inside.eye_world.x() = 550.0;
    EXPECT_FALSE(hides(resident, inside, {{900.0, 20.0, -100.0}, 5.0}));
    View beside = eastward();
    beside.eye_world.x() = -1100.0;
    EXPECT_FALSE(hides(resident, beside, behind));
}

TEST_F(HorizonOfAWall, AbsentChunksHideNoMoreThanResidentOnes) {
    const auto without_roots = std::make_shared<const ResidentSet>(
        source->lattice(), source->extent(), std::vector<std::shared_ptr<const Chunk>>{}, 1);
    EXPECT_FALSE(hides(without_roots, eastward(), behind));
    const auto roots = resident_chunks(*source, 0);
    Random random(3);
    HorizonMap coarse;
    coarse.build(roots, eastward(), {.refinable_px = 1.0});
    horizon.build(resident, eastward(), {.refinable_px = 1.0});
    int hidden = 0;
    for (int i = 0; i < 5000; ++i) {
        const BoundingSphere ball{{random.between(0.0, 1000.0), random.between(-500.0, 500.0),
                                   random.between(-20.0, 60.0)},
                                  random.between(0.1, 10.0)};
        EXPECT_LE(coarse.hides(ball), horizon.hides(ball));
        hidden += horizon.hides(ball) ? 1 : 0;
    }
    EXPECT_GT(hidden, 500);
}

// Another height field with some cells that are no ground, or without certificate.
class ChangedHeights final : public ForwardedHeights {
public:
    ChangedHeights(std::shared_ptr<const HeightSource> heights, WorldRect nodata, bool is_certified)
        : ForwardedHeights(std::move(heights)), nodata_(nodata), is_certified_(is_certified) {}

    bool is_certified() const override { return is_certified_; }
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        std::size_t at = 0;
        for (int row = 0; row + 1 < grid.rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column) {
                const double west = lattice().x(grid.corner.x + column * grid.step);
                const double south = lattice().y(grid.corner.y + row * grid.step);
                const double side = lattice().spacing * static_cast<double>(grid.step);
                const bool is_nodata = west < nodata_.east && west + side > nodata_.west &&
                                       south < nodata_.north && south + side > nodata_.south;
                flags_out[at++] = is_nodata ? cell_outside : cell_ground;
            }
        }
        return {};
    }

private:
    WorldRect nodata_;
    bool is_certified_;
};

TEST_F(HorizonOfAWall, HidesNothingBehindNodata) {
    const BoundingSphere beside{{900.0, 300.0, 5.0}, 5.0};
    EXPECT_TRUE(hides(resident, eastward(), beside));
    // far before the crest, just before it, on it, behind the wall
    for (const double west : {200.0, 440.0, 540.0, 700.0}) {
        const ChangedHeights changed(source, {west, 0.0, west + 8.0, 40.0}, true);
        const auto set = resident_chunks(changed, source->lattice().finest_level);
        EXPECT_EQ(hides(set, eastward(), behind), west > 500.0) << west;
        EXPECT_TRUE(horizon.hides(beside)) << west;
    }
}

TEST_F(HorizonOfAWall, HidesNothingWhereTheSourceIsNotCertified) {
    const ChangedHeights changed(source, {}, false);
    EXPECT_FALSE(hides(resident_chunks(changed, 1), eastward(), behind));
}

TEST_F(HorizonOfAWall, HidesNothingBehindVolumes) {
    for (const double x : {20.0, 300.0, 520.0}) {
        const auto set = resident_chunks(
            *source, source->lattice().finest_level, {}, [&](std::shared_ptr<const Chunk> chunk) {
                const Lattice& lattice = source->lattice();
                const double west = lattice.x(chunk->corner.x), south = lattice.y(chunk->corner.y);
                const double side = lattice.level_spacing(chunk->key.level) * kChunkCells;
                const bool has_volume = chunk->key.level == lattice.finest_level && x > west &&
                                        x < west + side && 5.0 > south && 5.0 < south + side;
                if (!has_volume) return chunk;
                auto changed = std::make_shared<Chunk>(*chunk);
                changed->solid = std::make_shared<const SolidSurface>(SolidTriangles{});
                return std::shared_ptr<const Chunk>(std::move(changed));
            });
        ASSERT_TRUE(set->has_solids());
        EXPECT_EQ(hides(set, eastward(), behind), x > 512.0) << "the chunk begins behind the crest";
    }
}

TEST_F(HorizonOfAWall, ClearsAndMoves) {
    EXPECT_TRUE(hides(resident, eastward(), behind));
    HorizonMap moved = std::move(horizon);
    EXPECT_TRUE(moved.hides(behind));
    moved.clear();
    EXPECT_FALSE(moved.hides(behind));
    EXPECT_FALSE(moved.is_of(eastward()));
    EXPECT_FALSE(HorizonMap().hides(behind));
}

}  // namespace
}  // namespace terrane::test::horizon_map
