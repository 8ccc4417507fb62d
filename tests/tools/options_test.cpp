// SPDX-License-Identifier: MIT
#include "program/options.h"

#include "flight/flight_options.h"
#include "frames/paging_storage.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/base/text.h>
#include <terrane/collision/shapes.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace terrane::tools {
namespace option_values_test {

TEST(ParseTime, TakesTimesOfIso8601WithAZoneAndNothingElse) {
    EXPECT_EQ(parse_time("1970-01-01T00:00Z"), 0.0);
    EXPECT_EQ(parse_time("1970-01-02T00:00:01Z"), 86401.0);
    EXPECT_EQ(parse_time("2026-06-21T14:30Z"), 1782052200.0);
    EXPECT_EQ(parse_time("2026-06-21T16:30:00+02:00"), 1782052200.0);
    EXPECT_EQ(parse_time("2026-06-21T09:00-05:30"), 1782052200.0);
    EXPECT_TRUE(parse_time("2024-02-29T00:00Z"));
    for (const char* text :
         {"", "now", "2026-06-21", "2026-06-21T14:30", "2026-06-21T14:30 Z", "2026-6-21T14:30Z",
          "2026-+6-21T14:30Z", "2026-02-29T00:00Z", "2026-06-21T24:00Z", "2026-06-21T14:60Z",
          "2026-06-21T14:30:60Z", "2026-06-21T14:30+2:00", "2026-06-21T14:30+02:00Z",
          "2026-06-21T14:30+25:00", "1899-12-31T00:00Z", "2101-01-01T00:00Z", "2026-06-21T-1:30Z",
          "+026-06-21T14:30Z"}) {
        EXPECT_FALSE(parse_time(text)) << text;
    }
}

TEST(ParseNumber, TakesAWholeTextWithAFiniteNumberOrAQuotient) {
    EXPECT_EQ(parse_number("1e3"), 1000.0);
    EXPECT_EQ(parse_number("-0.5"), -0.5);
    EXPECT_EQ(parse_number("+2"), 2.0);
    EXPECT_EQ(parse_number("1/60"), 1.0 / 60.0);
    for (const char* text :
         {"",    " 1",  "1 ",  "1m",   "x",        "--1",   "+-1", "+",  "0x10", "1,5",
          "nan", "NaN", "inf", "-inf", "infinity", "1e999", "1/0", "1/", "/2",   "1/2/3"}) {
        EXPECT_EQ(parse_number(text), std::nullopt) << text;
    }
}

TEST(ParsePoint, TakesThreeNumbersAndNothingElse) {
    EXPECT_EQ(parse_point("-1,2.5,3e2"), WorldPos(-1.0, 2.5, 300.0));
    for (const char* text : {"", "1", "1,2", "1,2,", "1,2,3,4", "1,,3", "1, 2, 3", "nan,0,0"}) {
        EXPECT_EQ(parse_point(text), std::nullopt) << text;
    }
}

TEST(ParseSize, RefusesEmptyAndAbsurdPictures) {
    ASSERT_TRUE(parse_size("1920x1080"));
    EXPECT_EQ(parse_size("1920x1080")->width_px, 1920);
    EXPECT_EQ(parse_size("1920x1080")->height_px, 1080);
    for (const char* text :
         {"", "x", "0x5", "5x0", "-1x5", "5", "5x5x5", "16385x1", "1e3x5", "5 x 5"}) {
        EXPECT_FALSE(parse_size(text)) << text;
    }
}

TEST(ParseList, RefusesEmptyItems) {
    using List = std::vector<std::string>;
    EXPECT_EQ(parse_list("5"), (List{"5"}));
    EXPECT_EQ(parse_list("5,20,a b"), (List{"5", "20", "a b"}));
    for (const char* text : {"", ",", "5,", ",5", "5,,20"}) {
        EXPECT_EQ(parse_list(text), std::nullopt) << text;
    }
}

}  // namespace option_values_test
}  // namespace terrane::tools

// Messages with numbers, of every library, are short for any value.

namespace terrane {
namespace messages_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::array kExtremes{1e300, -1e300,    1e-300,     -1e-300,   1.2345678901234567e17,
                               kNan,  kInfinite, -kInfinite, 0.1 + 0.2, -1.0 / 3.0};

TEST(NumberText, HasSixSignificantDigits) {
    EXPECT_EQ(number_text(1e300), "1e+300");
    EXPECT_EQ(number_text(0.1 + 0.2), "0.3");
    EXPECT_EQ(number_text(-1.0 / 3.0), "-0.333333");
    EXPECT_EQ(number_text(1e-9), "1e-09");
    EXPECT_EQ(number_text(1e12), "1e+12");
    EXPECT_EQ(number_text(0.0), "0");
    EXPECT_EQ(number_text(123456789), "123456789") << "whole numbers are exact";
    for (const double value : kExtremes) EXPECT_LE(number_text(value).size(), 13u);
}

// The error message for a value; "" where it is valid.
using Ask = std::function<std::string(double)>;

template <class T>
std::string message_of(const Result<T>& result) {
    return result ? "" : result.error().message;
}

void expect_short(const char* name, const Ask& ask) {
    bool has_refused = false;
    for (const double value : kExtremes) {
        const std::string message = ask(value);
        has_refused = has_refused || !message.empty();
        EXPECT_LE(message.size(), 120u) << name << ": " << message;
        int digits = 0;
        for (const char c : message) {
            digits = c >= '0' && c <= '9' ? digits + 1 : 0;
            EXPECT_LE(digits, 10) << name << ": " << message;
        }
    }
    EXPECT_TRUE(has_refused) << name << " takes everything: it tests nothing";
}

TEST(Messages, AreShortWhateverTheValue) {
    World world = World::create({}).value();
    const auto source = FractalHeights::create({}).value();
    expect_short("mass", [&](double value) {
        return message_of(world.add({.shape = Sphere{.radius = 1.0}, .mass = value}, {}));
    });
    expect_short("place", [&](double value) {
        BodyState state;
        state.pose.translation.x() = value;
        return message_of(world.add({.shape = Sphere{.radius = 1.0}}, state));
    });
    expect_short("rotation", [&](double value) {
        BodyState state;
        state.pose.rotation(0, 1) = value;
        return message_of(world.add({.shape = Sphere{.radius = 1.0}}, state));
    });
    expect_short("gravity", [](double value) {
        return message_of(World::create({.gravity = {value, 0.0, 0.0}}));
    });
    expect_short("hull", [](double value) {
        const std::array<Eigen::Vector3d, 1> points{{{value, 0.0, 0.0}}};
        return message_of(ConvexHull::create(points));
    });
    expect_short("vehicle", [&](double value) {
        VehicleSettings settings = make_truck();
        settings.axles[1].position = value;
        return message_of(world.add_vehicle(settings, {}));
    });
    expect_short("character", [&](double value) {
        return message_of(world.add_character({.radius = value}, {0.0, 0.0, 0.0}));
    });
    expect_short("amplitude", [](double value) {
        return message_of(FractalHeights::create({.amplitude = value}));
    });
    expect_short("threshold", [&](double value) {
        return message_of(Triangulator::create(*source, {.max_error_px = value}));
    });
    expect_short("field of view", [](double value) {
        return message_of(look_at({0, 0, 0}, {1, 0, 0}, value, 100, 100));
    });
    expect_short("bandwidth", [](double value) {
        return message_of(VirtualLoader::create({.bandwidth = -value}, {}));
    });
}

}  // namespace messages_test
}  // namespace terrane

namespace terrane::tools {
namespace slow_heights_test {

// Times are arguments: no clock is used.
TEST(FairPipe, SeveralShareItEvenly) {
    FairPipe pipe(100.0);
    const double a = pipe.begin(0.0, 20.0);
    const double b = pipe.begin(0.1, 20.0);  // a has 10 left
    EXPECT_FALSE(pipe.is_done(0.2999, a));
    EXPECT_DOUBLE_EQ(pipe.next_end(), 0.3);
    EXPECT_TRUE(pipe.is_done(0.3001, a));  // b has 10 left, and all of it
    EXPECT_FALSE(pipe.is_done(0.3999, b));
    EXPECT_TRUE(pipe.is_done(0.4001, b));
}

TEST(FairPipe, AgreesWithSharingSimulatedInSteps) {
    constexpr std::uint64_t kSeed = 20240608;
    test::Random random(kSeed);
    struct Transfer {
        double begin = 0.0, left = 0.0;  // simulated in steps
        double end = 1e9;                // the same
        double name = 0.0;
    };
    FairPipe pipe(1000.0);
    std::vector<Transfer> all(40);
    for (Transfer& transfer : all) {
        transfer.begin = random.between(0.0, 1.0);
        transfer.left = random.between(0.0, 60.0);
    }
    std::ranges::sort(all, {}, &Transfer::begin);
    constexpr double kStep = 1e-5, kNearly = 1e-3;
    std::size_t begun = 0;
    for (double now = 0.0; now < 3.0; now += kStep) {
        for (; begun < all.size() && all[begun].begin <= now; ++begun) {
            all[begun].name = pipe.begin(now, all[begun].left);
        }
        const auto under_way = std::count_if(all.begin(), all.begin() + static_cast<int>(begun),
                                             [](const Transfer& t) { return t.left > 0.0; });
        for (std::size_t i = 0; i < begun; ++i) {
            Transfer& transfer = all[i];
            if (now > transfer.end + kNearly) {
                EXPECT_TRUE(pipe.is_done(now, transfer.name)) << "seed " << kSeed << ", " << now;
            } else if (transfer.left > 1000.0 * kNearly) {
                EXPECT_FALSE(pipe.is_done(now, transfer.name)) << "seed " << kSeed << ", " << now;
            }
            if (transfer.left <= 0.0) continue;
            transfer.left -= 1000.0 * kStep / static_cast<double>(under_way);
            if (transfer.left <= 0.0) transfer.end = now;
        }
    }
    for (const Transfer& transfer : all) EXPECT_LT(transfer.end, 3.0);
}

TEST(SlowHeights, GivesTheChunksOfItsSource) {
    const auto source =
        std::make_shared<const test::WaveHeights>(test::small_world(2, 4.0), 100.0, 500.0);
    SlowHeights slow(source);
    EXPECT_EQ(slow.lattice(), source->lattice());
    EXPECT_EQ(slow.height(12.0, 34.0), source->height(12.0, 34.0));
    EXPECT_EQ(slow.interval({0, 0, 50, 50}).high, source->interval({0, 0, 50, 50}).high);
    EXPECT_EQ(slow.rise_bound(10.0), source->rise_bound(10.0));
    slow.set_speed({.latency = 1e-3, .bandwidth = 1e9});
    const ChunkKey key{0, 0, 1};
    const auto wanted = make_chunk(*source, key);
    source->sample_count = 0;
    const auto got = make_chunk(slow, key);
    ASSERT_TRUE(wanted);
    ASSERT_TRUE(got);
    EXPECT_EQ((*got)->heights, (*wanted)->heights);
    EXPECT_EQ((*got)->cell_bounds, (*wanted)->cell_bounds);
    EXPECT_EQ((*got)->max_vertex_bound, (*wanted)->max_vertex_bound);
    EXPECT_EQ(source->sample_count, 1) << "a chunk waits once";
}

}  // namespace slow_heights_test
}  // namespace terrane::tools
