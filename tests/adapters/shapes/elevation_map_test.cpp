// SPDX-License-Identifier: MIT
#include "adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/elevation_map.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::adapters {
namespace elevation_map_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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
            if (want.status == GroundStatus::ok) {
                ASSERT_EQ(map.layer()[at], static_cast<float>(want.height - origin.z()));
            } else {
                ASSERT_TRUE(std::isnan(map.layer()[at]));
            }
        }
    }
}

TEST(ElevationMap, HoldsTheHeightsOfTheGroundWhereverItMoves) {
    const Ground ground = test::make_test_ground(test::rough_height);
    ElevationMap map =
        ElevationMap::create({.length_x = 6.0, .length_y = 9.0, .resolution = 0.5}).value();
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
    ElevationMap map =
        ElevationMap::create({.length_x = 4.0, .length_y = 3.0, .resolution = 0.25}).value();
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
    ElevationMap map =
        ElevationMap::create({.length_x = 10.0, .length_y = 10.0, .resolution = 1.0}).value();
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
    test::TableGroundSettings settings;
    settings.roots = 2;
    const Ground whole = test::make_test_ground(test::plane_height, settings);
    ElevationMap map =
        ElevationMap::create({.length_x = 8.0, .length_y = 8.0, .resolution = 0.5}).value();
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
    for (const GroundStatus status : map.statuses()) EXPECT_EQ(status, GroundStatus::not_resident);
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
    ElevationMap map =
        ElevationMap::create(
            {.length_x = 4.0, .length_y = 4.0, .resolution = 0.5, .origin_world = origin})
            .value();
    for (int i = 0; i < 20; ++i) map.update(ground, 20.0 + i, 40.0 - i);
    expect_heights(map, ground, origin);
    const auto at = map.find(39.25, 21.25);
    ASSERT_TRUE(at);
    EXPECT_NEAR(map.layer()[*at], test::plane_height(39.25, 21.25), 1e-3);
}

TEST(ElevationMap, HasTheHighestSurfaceAboveARoom) {
    ElevationMap map =
        ElevationMap::create({.length_x = 4.0, .length_y = 4.0, .resolution = 0.5}).value();
    map.update(test::make_room_ground(), 50.0, 50.0);
    for (const float height : map.layer()) EXPECT_EQ(height, 20.0f);
}

TEST(ElevationMap, MayBeOneCellAndIsNeverNoneOrABillion) {
    ElevationMap one =
        ElevationMap::create({.length_x = 1.0, .length_y = 0.6, .resolution = 1.0}).value();
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
