// SPDX-License-Identifier: MIT
#include "support/random.h"

#include <terrane/terrain/surface.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace terrane {
namespace painted_surface_test {

constexpr SurfaceProperties kGrass{.friction = 0.5, .material = 1};
constexpr SurfaceProperties kIce{.friction = 0.05, .material = 7};
constexpr SurfaceProperties kRoad{.friction = 0.9, .material = 3};

TEST(PaintedSurface, IsTheLastAreaThatContainsAPlaceAndElseWhatIsUnder) {
    test::Random random(21);
    const auto under =
        SurfaceMap::from_function([](double x, double) { return x < 0.0 ? kGrass : kIce; }).value();
    std::vector<SurfaceArea> areas;
    for (std::uint32_t i = 0; i < 40; ++i) {
        // triangles: sides of three lines tell what is inside
        SurfaceArea& area = areas.emplace_back();
        const double x = random.between(-900.0, 900.0), y = random.between(-900.0, 900.0);
        for (int k = 0; k < 3; ++k) {
            area.polygon.corners.push_back(
                {x + random.between(-300.0, 300.0), y + random.between(-300.0, 300.0)});
        }
        area.properties = {.friction = 0.01 * i, .material = 100 + i};
    }
    const auto map = paint_surface(under, areas).value();
    int painted = 0;
    for (int i = 0; i < 20'000; ++i) {
        const double x = random.between(-1000.0, 1000.0), y = random.between(-1000.0, 1000.0);
        SurfaceProperties expected = under->at(x, y);
        for (const SurfaceArea& area : areas) {
            int left = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const PlanePoint &a = area.polygon.corners[k],
                                 &b = area.polygon.corners[(k + 1) % 3];
                left += (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0.0 ? 1 : 0;
            }
            if (left == 0 || left == 3) expected = area.properties;
        }
        ASSERT_EQ(map->at(x, y), expected) << x << ", " << y;
        painted += expected.material >= 100 ? 1 : 0;
    }
    EXPECT_GT(painted, 2000);
    EXPECT_EQ(map->fault_count(), 0u);
}

TEST(PaintedSurface, ShowsWhatIsUnderWhereAMapAnswersItsDefaults) {
    // a strip of ice in a map that knows no more
    const auto strip = SurfaceMap::from_function([](double x, double) {
                           return std::abs(x) < 10.0 ? kIce : SurfaceProperties{};
                       }).value();
    const SurfaceArea area{.polygon = polygon_of({-100.0, -100.0, 100.0, 100.0}), .map = strip};
    const auto map = paint_surface(SurfaceMap::from_rects({}, kGrass).value(), {&area, 1}).value();
    EXPECT_EQ(map->at(0.0, 0.0), kIce);
    EXPECT_EQ(map->at(50.0, 0.0), kGrass);
    EXPECT_EQ(map->at(0.0, 200.0), kGrass);
    EXPECT_EQ(map->defaults(), kGrass);
}

TEST(PaintedSurface, IncludesEdgesAndAnswersEverywhere) {
    const SurfaceArea area{.polygon = polygon_of({0.0, 0.0, 10.0, 10.0}), .properties = kRoad};
    const auto map = paint_surface(nullptr, {&area, 1}).value();
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {10.0, 10.0}, {10.0, 5.0}, {3.0, 0.0}}) {
        EXPECT_EQ(map->at(x, y), kRoad);
    }
    EXPECT_EQ(map->at(10.001, 5.0), SurfaceProperties{});
    EXPECT_EQ(map->at(std::nan(""), 5.0), SurfaceProperties{});
    EXPECT_EQ(map->at(1e300, -1e300), SurfaceProperties{});
    EXPECT_EQ(paint_surface(map, {}).value()->at(5.0, 5.0), kRoad);
}

TEST(PaintedSurface, RefusesAreasOutOfRange) {
    const auto message = [](const SurfaceArea& area) {
        const std::vector<SurfaceArea> areas{{.polygon = polygon_of({0.0, 0.0, 1.0, 1.0})}, area};
        const auto map = paint_surface(nullptr, areas);
        return map ? std::string("accepted") : map.error().message;
    };
    EXPECT_EQ(message({}), "areas[1].polygon must have at least 3 corners, got 0");
    EXPECT_EQ(
        message({.polygon = polygon_of({0.0, 0.0, 1.0, 1.0}), .properties = {.friction = -1.0}}),
        "areas[1].friction must be 0 to 1e+06, got -1");
}

}  // namespace painted_surface_test
}  // namespace terrane
