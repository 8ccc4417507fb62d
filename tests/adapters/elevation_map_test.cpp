// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/adapters/elevation_map.h>
#include <terrane/adapters/heightmap.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace terrane::adapters {
namespace heightmap_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::shared_ptr<const HeightSource> hills() {
    return FractalHeights::create({.seed = 9, .finest_spacing_log2 = 1, .root_size_log2 = 10})
        .value();
}

TEST(Heightmap, HasTheHeightsOfTheSourceRowByRowFromTheNorth) {
    const auto source = hills();
    const Heightmap map = make_heightmap(*source, {.centre_x = 13.1,
                                                   .centre_y = -31.0,
                                                   .side = 129,
                                                   .level = source->lattice().finest_level})
                              .value();
    EXPECT_EQ(map.spacing, 2.0);
    EXPECT_EQ(map.width(), 256.0);
    EXPECT_EQ(map.west, 14.0 - 128.0);  // the nearest point of the lattice
    ASSERT_EQ(map.heights.size(), 129u * 129u);
    for (int row = 0; row < map.side; ++row) {
        for (int column = 0; column < map.side; ++column) {
            const double height = map.heights[static_cast<std::size_t>(row * map.side + column)];
            ASSERT_NEAR(height, source->height(map.west + 2.0 * column, map.north - 2.0 * row),
                        1e-9);
        }
    }
    const auto [low, high] = std::ranges::minmax(map.heights);
    EXPECT_EQ(map.low, low);
    EXPECT_EQ(map.high, high);
    EXPECT_EQ(map.absent_count, 0);
}

TEST(Heightmap, RoundsToSixteenBitsWithinTheErrorThatItTells) {
    const auto source = hills();
    const Heightmap map = make_heightmap(*source, {.side = 257, .level = 2}).value();
    const std::vector<std::uint16_t> pixels = quantise(map);
    double largest = 0.0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double height = map.low + pixels[i] / 65535.0 * (map.high - map.low);
        largest = std::max(largest, std::abs(height - map.heights[i]));
    }
    const auto [least, most] = std::ranges::minmax(pixels);
    EXPECT_EQ(least, 0);
    EXPECT_EQ(most, 65535);
    EXPECT_LE(largest, quantisation_error(map));
    EXPECT_GT(largest, 0.9 * quantisation_error(map));
}

TEST(Heightmap, OfFlatGroundIsAllZeroAndHasASize) {
    const test::WaveHeights flat(test::small_world(3, 1.0), 0.0, 64.0);
    const Heightmap map = make_heightmap(flat, {.side = 65, .level = 3}).value();
    for (const std::uint16_t pixel : quantise(map)) ASSERT_EQ(pixel, 0);
    EXPECT_EQ(quantisation_error(map), 0.0);
    EXPECT_NE(sdf_model(map, "flat", "flat.png").find("<size>64 64 1</size>"), std::string::npos);
}

TEST(Heightmap, IsPlacedByItsModel) {
    const auto source = hills();
    const Heightmap map =
        make_heightmap(*source, {.centre_x = 100.0, .centre_y = 40.0, .side = 65, .level = 2})
            .value();
    const std::string sdf = sdf_model(map, "a<b", "x&y.png", {90.0, 30.0, map.low});
    EXPECT_NE(sdf.find("<pos>" + number_text(map.west + 0.5 * map.width() - 90.0) + " " +
                       number_text(map.north - 0.5 * map.width() - 30.0) + " 0</pos>"),
              std::string::npos)
        << sdf;
    EXPECT_NE(sdf.find("name=\"a&lt;b\""), std::string::npos);
    EXPECT_NE(sdf.find("<uri>x&amp;y.png</uri>"), std::string::npos);
}

TEST(Heightmap, HasNoHolesUnlessSomethingStandsThere) {
    const test::WaveHeights source(test::small_world(3, 1.0), 5.0, 64.0);
    const WorldRect& extent = source.extent();
    HeightmapSettings settings{.centre_x = extent.east, .centre_y = 0.0, .side = 65, .level = 3};
    const Result<Heightmap> refused = make_heightmap(source, settings);
    ASSERT_FALSE(refused);
    // the columns east of the extent
    EXPECT_EQ(refused.error().message, "a heightmap has no holes, and " + number_text(32 * 65) +
                                           " of its 4225 samples are no ground");
    settings.absent_height = -7.5;
    const Heightmap map = make_heightmap(source, settings).value();
    EXPECT_EQ(map.absent_count, 32 * 65);
    for (int row = 0; row < 65; ++row) {
        for (int column = 0; column < 65; ++column) {
            const double x = map.west + column, y = map.north - row;
            const double want = x > extent.east ? -7.5 : source.height(x, y);
            ASSERT_NEAR(map.heights[static_cast<std::size_t>(row * 65 + column)], want, 1e-9);
        }
    }
    settings.centre_x = -1e9;
    EXPECT_EQ(make_heightmap(source, settings).value().absent_count, 65 * 65);
}

TEST(Heightmap, TellsOfSourcesThatFail) {
    test::WaveHeights source(test::small_world(3, 1.0), 5.0, 64.0);
    source.gives_nan = true;
    const Result<Heightmap> no_number = make_heightmap(source, {.side = 5, .level = 3});
    ASSERT_FALSE(no_number);
    EXPECT_EQ(no_number.error().code, ErrorCode::bad_data);
    source.is_broken = true;
    EXPECT_FALSE(make_heightmap(source, {.side = 5, .level = 3}));
}

TEST(Heightmap, RefusesSettingsOutOfRange) {
    const test::WaveHeights source(test::small_world(3, 1.0), 5.0, 64.0);
    for (const HeightmapSettings& settings :
         {HeightmapSettings{.side = 0}, HeightmapSettings{.side = 2},
          HeightmapSettings{.side = 128}, HeightmapSettings{.side = -1},
          HeightmapSettings{.side = 1'000'000'001}, HeightmapSettings{.level = -1},
          HeightmapSettings{.level = 4}, HeightmapSettings{.centre_x = kNan},
          HeightmapSettings{.centre_y = 1e300}, HeightmapSettings{.absent_height = kNan}}) {
        const Result<Heightmap> refused = make_heightmap(source, settings);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(refused.error().message.find(", got "), std::string::npos);
    }
}

}  // namespace heightmap_test

namespace elevation_map_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ElevationMap make_map(double length_x, double length_y, double resolution,
                      const WorldPos& origin = WorldPos::Zero()) {
    return ElevationMap::create({.length_x = length_x,
                                 .length_y = length_y,
                                 .resolution = resolution,
                                 .origin_world = origin})
        .value();
}

// The indices of a grid map as grid_map_core documents them, for comparison: against the axes, in a circular buffer.
// Written from the documentation.
struct GridMapOracle {
    GridMapOracle(std::int64_t rows, std::int64_t columns, double side)
        : size{rows, columns}, resolution(side) {}

    std::array<std::int64_t, 2> buffer_index(double x, double y) const {
        std::array<std::int64_t, 2> found{};
        const std::array<double, 2> place{x, y};
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const double top = position[axis] + 0.5 * resolution * static_cast<double>(size[axis]);
            const auto unwrapped =
                static_cast<std::int64_t>(std::floor((top - place[axis]) / resolution));
            found[axis] = (unwrapped + start[axis]) % size[axis];
        }
        return found;
    }
    void move(double x, double y) {
        const std::array<double, 2> target{x, y};
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const double cells = (target[axis] - position[axis]) / resolution;
            const auto shift = static_cast<std::int64_t>(cells + (cells > 0.0 ? 0.5 : -0.5));
            position[axis] += static_cast<double>(shift) * resolution;
            const std::int64_t n = size[axis];
            start[axis] = ((start[axis] - shift) % n + n) % n;
        }
    }

    std::array<std::int64_t, 2> size;
    double resolution;
    std::array<double, 2> position{};
    std::array<std::int64_t, 2> start{};
};

// Every cell is the ground's height at its centre, or NaN with the ground's status.
void expect_heights(const ElevationMap& map, const Ground& ground, const WorldPos& origin) {
    for (std::int64_t column = 0; column < map.columns(); ++column) {
        for (std::int64_t row = 0; row < map.rows(); ++row) {
            const double x = map.cell_x(row), y = map.cell_y(column);
            const HeightAnswer want = ground.height(origin.x() + x, origin.y() + y);
            const std::size_t at = map.index(row, column);
            ASSERT_EQ(map.find(x, y), at) << row << ' ' << column;
            ASSERT_EQ(map.statuses()[at], want.status);
            if (want.status == QueryStatus::ok) {
                ASSERT_EQ(map.layer()[at], static_cast<float>(want.height - origin.z()));
            } else {
                ASSERT_TRUE(std::isnan(map.layer()[at]));
            }
        }
    }
}

TEST(ElevationMap, HoldsTheHeightsOfTheGroundWhereverItMoves) {
    const Ground ground = test::make_test_ground(test::rough_height);
    ElevationMap map = make_map(6.0, 9.0, 0.5);
    ASSERT_EQ(map.rows(), 12);
    ASSERT_EQ(map.columns(), 18);
    test::Random random(23);
    double x = 64.0, y = 64.0;
    for (int i = 0; i < 200; ++i) {
        x += random.between(-3.0, 3.0);
        y += random.between(-3.0, 3.0);
        if (i % 50 == 49) x = random.between(-20.0, 150.0);  // also over the border
        map.update(ground, x, y);
        EXPECT_NEAR(map.position_x(), x, 0.25 + 1e-9);
        EXPECT_NEAR(map.position_y(), y, 0.25 + 1e-9);
        expect_heights(map, ground, WorldPos::Zero());
    }
}

TEST(ElevationMap, HasTheBufferOfAGridMap) {
    const Ground ground = test::make_test_ground(test::rough_height);
    ElevationMap map = make_map(4.0, 3.0, 0.25);
    GridMapOracle oracle(16, 12, 0.25);
    test::Random random(29);
    double x = 64.0, y = 64.0;
    for (int i = 0; i < 100; ++i) {
        x += random.between(-2.0, 2.0);
        y += random.between(-2.0, 2.0);
        map.update(ground, x, y);
        oracle.move(x, y);
        ASSERT_EQ(map.position_x(), oracle.position[0]);
        ASSERT_EQ(map.position_y(), oracle.position[1]);
        ASSERT_EQ(map.start_row(), oracle.start[0]);
        ASSERT_EQ(map.start_column(), oracle.start[1]);
        for (int k = 0; k < 20; ++k) {
            const double px = map.position_x() + random.between(-1.99, 1.99);
            const double py = map.position_y() + random.between(-1.49, 1.49);
            const auto [row, column] = oracle.buffer_index(px, py);
            ASSERT_EQ(map.find(px, py), static_cast<std::size_t>(column * 16 + row));
        }
    }
}

TEST(ElevationMap, ReadsOnlyWhatEntered) {
    const Ground ground = test::make_test_ground(test::rough_height);
    ElevationMap map = make_map(10.0, 10.0, 1.0);
    EXPECT_EQ(map.update(ground, 64.0, 64.0).read_cells, 100);
    EXPECT_EQ(map.update(ground, 64.4, 63.6).read_cells, 0);
    const ElevationMapUpdate east = map.update(ground, 66.0, 64.0);
    EXPECT_EQ(east.moved_x, 2);
    EXPECT_EQ(east.read_cells, 20);
    EXPECT_EQ(map.update(ground, 66.0, 61.0).read_cells, 30);
    EXPECT_EQ(map.update(ground, 20.0, 20.0).read_cells, 100);
    expect_heights(map, ground, WorldPos::Zero());
}

TEST(ElevationMap, FollowsGroundThatArrivesAndGoes) {
    const Ground part = test::make_broken_ground();
    const Ground whole = test::make_test_ground(test::plane_height, 1.0, 2);
    ElevationMap map = make_map(8.0, 8.0, 0.5);
    const ElevationMapUpdate before = map.update(part, 128.0, 128.0);
    EXPECT_EQ(before.absent_cells, 64);
    expect_heights(map, part, WorldPos::Zero());
    EXPECT_EQ(map.update(whole, 128.0, 128.0).absent_cells, 0);
    expect_heights(map, whole, WorldPos::Zero());
    map.update(part, 128.0, 128.0);
    expect_heights(map, part, WorldPos::Zero());
    map.update(part, 8.0, 64.0);
    expect_heights(map, part, WorldPos::Zero());
    EXPECT_EQ(map.update(part, -1e9, 1e9).absent_cells, 256);
    expect_heights(map, part, WorldPos::Zero());
}

TEST(ElevationMap, HasNothingButNanBeforeItsFirstUpdate) {
    const ElevationMap map = ElevationMap::create({}).value();
    EXPECT_EQ(map.layer().size(), 10'000u);
    for (const float height : map.layer()) EXPECT_TRUE(std::isnan(height));
    for (const QueryStatus status : map.statuses()) EXPECT_EQ(status, QueryStatus::not_resident);
    EXPECT_FALSE(map.find(6.0, 0.0));
    EXPECT_FALSE(map.find(kNan, 0.0));
}

TEST(ElevationMap, RefusesPlacesThatAreNotFinite) {
    const Ground ground = test::make_test_ground(test::plane_height);
    ElevationMap map = ElevationMap::create({}).value();
    map.update(ground, 50.0, 50.0);
    const std::vector<float> before(map.layer().begin(), map.layer().end());
    for (const double bad : {kNan, std::numeric_limits<double>::infinity(), 1e300}) {
        EXPECT_TRUE(map.update(ground, bad, 50.0).is_refused);
        EXPECT_TRUE(map.update(ground, 50.0, -bad).is_refused);
    }
    EXPECT_TRUE(std::equal(before.begin(), before.end(), map.layer().begin()));
    EXPECT_EQ(map.position_x(), 50.0);
}

TEST(ElevationMap, KeepsItsPrecisionAMillionKilometresOut) {
    const Ground ground = test::make_far_ground();
    const WorldPos origin(1e9, -1e9, 1e5);
    ElevationMap map = make_map(4.0, 4.0, 0.5, origin);
    for (int i = 0; i < 20; ++i) map.update(ground, 20.0 + i, 40.0 - i);
    expect_heights(map, ground, origin);
    const auto at = map.find(39.25, 21.25);
    ASSERT_TRUE(at);
    EXPECT_NEAR(map.layer()[*at], test::plane_height(39.25, 21.25), 1e-3);
}

TEST(ElevationMap, HasTheHighestSurfaceAboveARoom) {
    ElevationMap map = make_map(4.0, 4.0, 0.5);
    map.update(test::make_room_ground(), 50.0, 50.0);
    for (const float height : map.layer()) EXPECT_EQ(height, 20.0f);
}

TEST(ElevationMap, MayBeOneCellAndIsNeverNoneOrABillion) {
    ElevationMap one = make_map(1.0, 0.6, 1.0);
    EXPECT_EQ(one.update(test::make_test_ground(test::plane_height), 9.0, 9.0).read_cells, 1);
    EXPECT_EQ(one.layer()[0], static_cast<float>(test::plane_height(9.0, 9.0)));
    for (const ElevationMapSettings& settings :
         {ElevationMapSettings{.length_x = 0.0}, ElevationMapSettings{.length_y = 0.01},
          ElevationMapSettings{.length_x = -1.0}, ElevationMapSettings{.length_x = kNan},
          ElevationMapSettings{.resolution = 0.0}, ElevationMapSettings{.resolution = kNan},
          ElevationMapSettings{.length_x = 1e9, .resolution = 1.0},
          ElevationMapSettings{.length_x = 32'000, .length_y = 32'000, .resolution = 1.0},
          ElevationMapSettings{.length_x = 1e300, .length_y = 1e300, .resolution = 1.0},
          ElevationMapSettings{.origin_world = {0, kNan, 0}}}) {
        const Result<ElevationMap> refused = ElevationMap::create(settings);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    }
}

}  // namespace elevation_map_test
}  // namespace terrane::adapters
