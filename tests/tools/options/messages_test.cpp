// SPDX-License-Identifier: MIT
// Messages with numbers, of every library, are short for any value.
#include <terrane/base/text.h>
#include <terrane/collision/shapes.h>
#include <terrane/collision/world.h>
#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <string>

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

TEST(Messages, OfBodiesAreShortWhateverTheValue) {
    World world = World::create({}).value();
    expect_short("mass", [&](double value) {
        return message_of(world.add({.shape = Sphere{.radius = 1.0}, .mass = value}, {}));
    });
    expect_short("friction", [&](double value) {
        return message_of(world.add({.shape = Sphere{.radius = 1.0}, .friction = value}, {}));
    });
    expect_short("radius", [&](double value) {
        return message_of(world.add({.shape = Sphere{.radius = value}}, {}));
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
    expect_short("part", [](double value) {
        std::array parts{CompoundPart{Sphere{.radius = 1.0}, {}}};
        parts[0].body_from_part.translation.x() = value;
        return message_of(Compound::create(parts));
    });
    expect_short("vehicle", [&](double value) {
        VehicleSettings settings = make_truck();
        settings.axles[1].position = value;
        return message_of(world.add_vehicle(settings, {}));
    });
    expect_short("character", [&](double value) {
        CharacterSettings settings;
        settings.radius = value;
        return message_of(world.add_character(settings, {0.0, 0.0, 0.0}));
    });
}

TEST(Messages, OfBodiesNameTheUnitAndTheRange) {
    World world = World::create({}).value();
    EXPECT_EQ(message_of(world.add({.shape = Sphere{.radius = 1.0}, .mass = 1e300}, {})),
              "mass must be 1e-09 to 1e+12 kg, got 1e+300");
}

TEST(Messages, OfTerrainAreShortWhateverTheValue) {
    expect_short("amplitude", [](double value) {
        return message_of(FractalHeights::create({.amplitude = value}));
    });
    expect_short("gain",
                 [](double value) { return message_of(FractalHeights::create({.gain = value})); });
    const auto source = FractalHeights::create({}).value();
    expect_short("threshold", [&](double value) {
        return message_of(Triangulator::create(*source, {.max_error_px = value}));
    });
    expect_short("horizon", [&](double value) {
        return message_of(Pager::create(source, {.horizon = value}));
    });
    expect_short("field of view", [](double value) {
        return message_of(look_at({0, 0, 0}, {1, 0, 0}, value, 100, 100));
    });
    expect_short("bandwidth", [](double value) {
        VirtualStorage storage;
        storage.bandwidth = -value;
        return message_of(VirtualLoader::create(storage, {}));
    });
}

}  // namespace messages_test
}  // namespace terrane
