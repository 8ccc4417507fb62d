// SPDX-License-Identifier: MIT
//
// Time of contact beside volumes over that on the heightfield alone: the same shapes, at rest and in free motion, on
// rough ground and on the contour of a cavity whose floor has the same form. One thread.
//
//   mesh_contact_benchmark [--quick] [--only SHAPE]
#include "benchmark/bench.h"
#include "collision/ground/volume_ground.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace terrane::bench {
namespace {

using test::Random;

struct Named {
    const char* name;
    Shape shape;
};

std::vector<Named> make_shapes() {
    return {{"sphere", Sphere{0.5}}, {"capsule", Capsule{0.4, 0.8}}, {"box", Box{{1.0, 2.0, 0.5}}}};
}

struct Place {
    const Ground& ground;
    double floor;  ///< metres
};

struct Times {
    double step_us = 0.0;   ///< of a body
    double query_us = 0.0;  ///< find_contacts() of bodies at rest
};

/// Bodies that fall on a floor and come to rest on it, and then lie there awake.
Times measure(const Place& place, const Shape& shape, int count, int steps) {
    WorldSettings settings;
    settings.allow_sleep = false;
    settings.collide_bodies = false;
    settings.measure_depth = false;
    World world = World::create(settings).value();
    Random random(5);
    for (int i = 0; i < count; ++i) {
        BodyState state;
        state.pose.translation = {random.between(40.0, 88.0), random.between(40.0, 88.0),
                                  place.floor + 3.5};
        state.velocity = {random.between(-2.0, 2.0), random.between(-2.0, 2.0), 0.0};
        world.add({.shape = shape, .friction = 0.3}, state).value();
    }
    for (int i = 0; i < steps; ++i) world.step(place.ground, 1.0 / 60.0);
    Times times;
    const Stopwatch stepping(Clock::thread);
    for (int i = 0; i < steps; ++i) world.step(place.ground, 1.0 / 60.0);
    times.step_us = 1e3 * stepping.ms() / (steps * count);
    std::array<Contact, 64> contacts;
    std::size_t found = 0;
    const Stopwatch asking(Clock::thread);
    for (const BodyState& state : world.states()) {
        found += find_contacts(shape, state.pose, place.ground, 0.005, contacts).count;
    }
    times.query_us = 1e3 * asking.ms() / count;
    if (found == 0) std::printf("no contacts: the bodies are not where they should be\n");
    return times;
}

void run(bool is_quick, Choice& only) {
    std::printf("%s\n", describe_machine().c_str());
    const auto rough = [](double x, double y) {
        return 60.0 + 0.4 * std::sin(0.5 * x) * std::cos(0.4 * y);
    };
    const Ground field = test::make_test_ground(rough, 1.0, 1);
    const Ground solid = test::make_volume_ground(
        rough, {test::place_volume(
                   VolumeOp::remove, VolumeBox{{32.0, 32.0, 6.0}}, {64.0, 64.0, 30.0},
                   Motion{{}, Eigen::Vector3d::Zero(), {0.01, 0.015, 0.02}}.at(1.0).rotation)});
    const int count = is_quick ? 10 : 400, steps = is_quick ? 5 : 300;
    std::printf("%-8s %12s %12s %6s %14s %14s %6s\n", "", "step, us", "in a cavity", "ratio",
                "contacts, us", "in a cavity", "ratio");
    for (const Named& each : make_shapes()) {
        if (!only.has(each.name)) continue;
        const Times a = measure({field, 60.0}, each.shape, count, steps);
        const Times b = measure({solid, 24.3}, each.shape, count, steps);
        std::printf("%-8s %12.2f %12.2f %6.2f %14.2f %14.2f %6.2f\n", each.name, a.step_us,
                    b.step_us, b.step_us / a.step_us, a.query_us, b.query_us,
                    b.query_us / a.query_us);
    }
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "mesh_contact_benchmark [--quick] [--only SHAPE]");
    const bool is_quick = arguments.has("--quick");
    Choice only(arguments.text("--only", ""), Choice::Match::whole);
    arguments.finish();
    run(is_quick, only);
    only.finish(arguments);
    return 0;
}
