// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/surface.h>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <latch>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace terrane::surface_test {

using namespace test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();
const double kNaN = std::nan("");

constexpr SurfaceProperties kGrass{.friction = 0.5, .restitution = 0.1, .material = 1};
constexpr SurfaceProperties kIce{.friction = 0.05, .restitution = 0.3, .material = 7};
constexpr SurfaceProperties kRoad{.friction = 0.9, .restitution = 0.0, .material = 4294967295u};

using Map = std::shared_ptr<const SurfaceMap>;

Map map_of(std::vector<SurfaceRect> rects, const SurfaceProperties& defaults = kGrass) {
    return SurfaceMap::from_rects(rects, defaults).value();
}

std::string error_of(const Result<Map>& map) {
    EXPECT_FALSE(map.has_value()) << "the map was made";
    if (map) return {};
    EXPECT_EQ(map.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(map.error().message.find('\n'), std::string::npos) << map.error().message;
    return map.error().message;
}

TEST(SurfaceProperties, AreCheckedWithTheirFieldAndValue) {
    EXPECT_TRUE(SurfaceProperties{}.validate());
    EXPECT_TRUE((SurfaceProperties{.friction = 0.0, .restitution = 0.0, .material = 4294967295u}
                     .validate()));
    EXPECT_TRUE((SurfaceProperties{.friction = 1e6, .restitution = 1.0}.validate()));
    struct Wrong {
        SurfaceProperties properties;
        const char* message;
    };
    for (const Wrong& wrong :
         {Wrong{{.friction = -1e-3}, "friction must be 0 to 1e+06, got -0.001"},
          Wrong{{.friction = 2e6}, "friction must be 0 to 1e+06, got 2e+06"},
          Wrong{{.friction = kNaN}, "friction must be 0 to 1e+06, got nan"},
          Wrong{{.friction = kInfinity}, "friction must be 0 to 1e+06, got inf"},
          Wrong{{.restitution = -0.5}, "restitution must be 0 to 1, got -0.5"},
          Wrong{{.restitution = 1.5}, "restitution must be 0 to 1, got 1.5"},
          Wrong{{.restitution = kNaN}, "restitution must be 0 to 1, got nan"}}) {
        const auto checked = wrong.properties.validate();
        ASSERT_FALSE(checked.has_value()) << wrong.message;
        EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
        EXPECT_EQ(checked.error().message, wrong.message);
    }
}

TEST(SurfaceMap, AnswersTheDefaultsAndCountsWhereItsFunctionIsOutOfRangeOrThrows) {
    const std::array<SurfaceProperties, 7> answers{SurfaceProperties{.friction = kNaN},
                                                   {.friction = -1e-300},
                                                   {.friction = std::nextafter(1e6, 2e6)},
                                                   {.friction = kInfinity},
                                                   {.restitution = kNaN},
                                                   {.restitution = -0.1},
                                                   {.restitution = std::nextafter(1.0, 2.0)}};
    const Map map = SurfaceMap::from_function(
                        [&](double x, double) {
                            if (x == -1.0) throw std::runtime_error("no data");
                            if (x == -2.0) throw 7;
                            return x < 7.0 ? answers[static_cast<std::size_t>(x)] : kIce;
                        },
                        kGrass)
                        .value();
    for (std::size_t i = 0; i < answers.size(); ++i) {
        EXPECT_EQ(map->fault_count(), i);
        EXPECT_EQ(map->at(static_cast<double>(i), 0.0), kGrass) << i;
    }
    EXPECT_EQ(map->at(-1.0, 0.0), kGrass);
    EXPECT_EQ(map->at(-2.0, 0.0), kGrass);
    EXPECT_EQ(map->at(100.0, 0.0), kIce);
    EXPECT_EQ(map->fault_count(), answers.size() + 2);
}

TEST(SurfaceMap, DoesNotAskItsFunctionAboutPlacesThatAreNotFinite) {
    int calls = 0;
    const Map map = SurfaceMap::from_function(
                        [&calls](double, double) {
                            ++calls;
                            return kIce;
                        },
                        kGrass)
                        .value();
    for (const double wrong : {kNaN, kInfinity, -kInfinity}) {
        EXPECT_EQ(map->at(wrong, 0.0), kGrass);
        EXPECT_EQ(map->at(0.0, wrong), kGrass);
    }
    EXPECT_EQ(calls, 0);
    EXPECT_EQ(map->fault_count(), 0u);
    EXPECT_EQ(map->at(kLargest, -kLargest), kIce);
    EXPECT_EQ(calls, 1);
}

TEST(SurfaceMap, RefusesAnEmptyFunctionAndDefaultsOutOfRange) {
    EXPECT_EQ(error_of(SurfaceMap::from_function({})),
              "function must be one that can be called, got an empty one");
    EXPECT_EQ(error_of(SurfaceMap::from_function([](double, double) { return kIce; },
                                                 {.friction = -1.0})),
              "defaults.friction must be 0 to 1e+06, got -1");
    EXPECT_EQ(error_of(SurfaceMap::from_rects({}, {.restitution = 2.0})),
              "defaults.restitution must be 0 to 1, got 2");
}

// A user-defined map.
class Checkers final : public SurfaceMap {
public:
    Checkers() : SurfaceMap(kGrass) {}

private:
    SurfaceProperties properties(double x, double y) const override {
        if (x < 0.0) return {.friction = x};
        return std::fmod(std::floor(x) + std::floor(y), 2.0) == 0.0 ? kIce : kRoad;
    }
};

TEST(SurfaceMap, KeepsItsPromisesForAClassOfACaller) {
    const Map map = std::make_shared<const Checkers>();
    EXPECT_EQ(map->at(0.5, 0.5), kIce);
    EXPECT_EQ(map->at(1.5, 0.5), kRoad);
    EXPECT_EQ(map->at(kNaN, 0.5), kGrass);
    EXPECT_EQ(map->fault_count(), 0u);
    EXPECT_EQ(map->at(-0.5, 0.5), kGrass);
    EXPECT_EQ(map->fault_count(), 1u);
}

TEST(SurfaceMap, CountsEveryFaultOfThreadsAtOnce) {
    const Map map = SurfaceMap::from_function([](double x, double) {
                        return SurfaceProperties{.friction = x};
                    }).value();
    constexpr int kThreads = 4, kCalls = 200'000;
    std::array<int, kThreads> wrong{};
    std::latch start(kThreads);  // so that they really run concurrently
    std::vector<std::thread> threads;
    for (int& wrong_of_thread : wrong) {
        threads.emplace_back([&] {
            start.arrive_and_wait();
            for (int i = 0; i < kCalls; ++i) {
                const double x = i % 2 == 0 ? -1.0 : 1.0 + i;
                const double friction = map->at(x, 0.0).friction;
                if (friction != (x < 0.0 ? 0.6 : x)) ++wrong_of_thread;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, (std::array<int, kThreads>{}));
    EXPECT_EQ(map->fault_count(), static_cast<std::uint64_t>(kThreads * kCalls / 2));
}

TEST(SurfaceRects, ContainTheirEdgesAndNothingBeyond) {
    const Map map = map_of({{.rect = {-1.0, 2.0, 3.0, 5.0}, .properties = kIce}});
    for (const double x : {-1.0, 0.0, 3.0}) {
        for (const double y : {2.0, 3.0, 5.0}) EXPECT_EQ(map->at(x, y), kIce) << x << ' ' << y;
    }
    EXPECT_EQ(map->at(std::nextafter(-1.0, -2.0), 3.0), kGrass);
    EXPECT_EQ(map->at(std::nextafter(3.0, 4.0), 3.0), kGrass);
    EXPECT_EQ(map->at(0.0, std::nextafter(2.0, 1.0)), kGrass);
    EXPECT_EQ(map->at(0.0, std::nextafter(5.0, 6.0)), kGrass);
}

TEST(SurfaceRects, MayBeInfiniteALineOrAPoint) {
    const Map map =
        map_of({{.rect = {-kInfinity, -kInfinity, kInfinity, kInfinity}, .properties = kIce},
                {.rect = {10.0, -kInfinity, kInfinity, kInfinity}, .properties = kRoad},
                {.rect = {0.0, 0.0, 0.0, 5.0}, .properties = kGrass},
                {.rect = {1.0, 1.0, 1.0, 1.0}, .properties = kRoad}});
    EXPECT_EQ(map->at(-kLargest, kLargest), kIce);
    EXPECT_EQ(map->at(kLargest, -kLargest), kRoad);
    EXPECT_EQ(map->at(0.0, 2.0), kGrass);
    EXPECT_EQ(map->at(1e-300, 2.0), kIce);
    EXPECT_EQ(map->at(1.0, 1.0), kRoad);
    EXPECT_EQ(map->at(1.0, 1.0 + 1e-15), kIce);
}

TEST(SurfaceRects, AreNamedWithTheirIndexWhereTheyAreWrong) {
    const SurfaceRect good{.rect = {0.0, 0.0, 1.0, 1.0}, .properties = kIce};
    struct Wrong {
        SurfaceRect rect;
        const char* message;
    };
    for (const Wrong& wrong :
         {Wrong{{.rect = {2.0, 0.0, 1.0, 1.0}}, "rects[1].west must be at most east, got 2 and 1"},
          Wrong{{.rect = {0.0, 5.0, 1.0, 1.0}},
                "rects[1].south must be at most north, got 5 and 1"},
          Wrong{{.rect = {kNaN, 0.0, 1.0, 1.0}},
                "rects[1].west must be at most east, got nan and 1"},
          Wrong{{.rect = {0.0, 0.0, 1.0, kNaN}},
                "rects[1].south must be at most north, got 0 and nan"},
          Wrong{{.rect = {0.0, 0.0, 1.0, 1.0}, .properties = {.friction = 1e7}},
                "rects[1].friction must be 0 to 1e+06, got 1e+07"}}) {
        const std::array<SurfaceRect, 2> rects{good, wrong.rect};
        EXPECT_EQ(error_of(SurfaceMap::from_rects(rects)), wrong.message);
    }
}

// The last rectangle of the list that contains the point.
SurfaceProperties slow_answer(const std::vector<SurfaceRect>& rects, double x, double y) {
    for (auto rect = rects.rbegin(); rect != rects.rend(); ++rect) {
        if (rect->rect.contains(x, y)) return rect->properties;
    }
    return kGrass;
}

std::vector<SurfaceRect> random_rects(Random& random, int count, double size) {
    std::vector<SurfaceRect> rects;
    for (int i = 0; i < count; ++i) {
        // whole numbers, so that some edges coincide
        const double west = random.below(100), south = random.below(100);
        WorldRect rect{west, south, west + std::floor(random.between(0.0, size)),
                       south + std::floor(random.between(0.0, size))};
        if (i % 17 == 5) rect.west = -kInfinity;
        if (i % 19 == 7) rect.north = kInfinity;
        if (i % 41 == 9) rect.south = -kInfinity;
        rects.push_back({rect,
                         {.friction = random.between(0.0, 2.0),
                          .restitution = random.between(0.0, 1.0),
                          .material = static_cast<std::uint32_t>(i)}});
    }
    return rects;
}

TEST(SurfaceRects, AnswerAsASearchOfTheWholeList) {
    SeededRandom random(11);
    for (const int count : {0, 1, 2, 4, 5, 9, 64, 700}) {
        for (const double size : {1.0, 4.0, 30.0, 120.0}) {
            const std::vector<SurfaceRect> rects = random_rects(random, count, size);
            const Map map = map_of(rects);
            for (int i = 0; i < 2000; ++i) {
                double x = random.between(-5.0, 150.0), y = random.between(-5.0, 150.0);
                if (i % 3 == 0) x = std::floor(x);
                if (i % 4 == 0) y = std::floor(y);
                ASSERT_EQ(map->at(x, y), slow_answer(rects, x, y))
                    << count << " rectangles of " << size << ", at " << x << ' ' << y;
            }
        }
    }
}

class SurfaceOfGround : public testing::Test {
protected:
    static Ground ground_with(Map map) {
        const Lattice lattice{.finest_level = 2};
        return {std::make_shared<const ResidentSet>(lattice, WorldRect{0.0, 0.0, 512.0, 512.0},
                                                    std::vector<std::shared_ptr<const Chunk>>{}, 0),
                2, std::move(map)};
    }
};

TEST_F(SurfaceOfGround, IsThatOfItsMapWhereGroundIsOutsideAndNotResidentToo) {
    const Map map = map_of({{.rect = {0.0, 0.0, 1000.0, 10.0}, .properties = kIce}});
    const Ground ground = ground_with(map);
    ASSERT_EQ(ground.height(5.0, 5.0).status, QueryStatus::not_resident);
    EXPECT_EQ(ground.surface(5.0, 5.0), kIce);
    EXPECT_EQ(ground.surface(5.0, 20.0), kGrass);
    ASSERT_EQ(ground.height(900.0, 5.0).status, QueryStatus::outside);
    EXPECT_EQ(ground.surface(900.0, 5.0), kIce);
    EXPECT_EQ(ground.surface(kNaN, 5.0), kGrass);
    EXPECT_EQ(ground.surface_map(), map);
}

TEST_F(SurfaceOfGround, OutlivesWhoMadeTheMap) {
    Map map = map_of({{.rect = {0.0, 0.0, 10.0, 10.0}, .properties = kIce}});
    const std::weak_ptr<const SurfaceMap> watched = map;
    {
        Ground first = ground_with(std::move(map));
        const Ground copy = first;
        first = ground_with(nullptr);
        EXPECT_FALSE(first.surface(5.0, 5.0).has_value());
        EXPECT_EQ(first.surface_map(), nullptr);
        EXPECT_EQ(copy.surface(5.0, 5.0), kIce);
    }
    EXPECT_TRUE(watched.expired());
}

TEST_F(SurfaceOfGround, HasTheSameBitsOnAllThreads) {
    constexpr std::uint64_t kSeed = 12;
    Random random(kSeed);
    const std::vector<SurfaceRect> rects = random_rects(random, 300, 30.0);
    const Ground ground = ground_with(map_of(rects));
    constexpr int kThreads = 4;
    std::array<std::uint64_t, kThreads> hashes{};
    std::vector<std::thread> threads;
    for (std::uint64_t& hash : hashes) {
        threads.emplace_back([&ground, &hash] {
            Random places(kSeed);
            for (int i = 0; i < 20000; ++i) {
                const double x = places.between(0.0, 150.0), y = places.between(0.0, 150.0);
                const SurfaceProperties found = *ground.surface(x, y);
                hash = hash * 0x9e3779b97f4a7c15u + std::bit_cast<std::uint64_t>(found.friction);
                hash = hash * 0x9e3779b97f4a7c15u + std::bit_cast<std::uint64_t>(found.restitution);
                hash += found.material;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, hashes.front()) << "seed " << kSeed;
    EXPECT_NE(hashes.front(), 0u);
}

}  // namespace terrane::surface_test

namespace terrane::painted_surface_test {

constexpr SurfaceProperties kGrass{.friction = 0.5, .material = 1};
constexpr SurfaceProperties kIce{.friction = 0.05, .material = 7};
constexpr SurfaceProperties kRoad{.friction = 0.9, .material = 3};

TEST(PaintedSurface, IsTheLastAreaThatContainsAPlaceAndElseWhatIsUnder) {
    test::Random random(21);
    const auto under =
        SurfaceMap::from_function([](double x, double) { return x < 0.0 ? kGrass : kIce; }).value();
    std::vector<SurfaceArea> areas;
    for (std::uint32_t i = 0; i < 40; ++i) {
        // triangles, so that three half-planes decide what is inside
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
    // a strip of ice; elsewhere the map has its defaults
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

}  // namespace terrane::painted_surface_test
