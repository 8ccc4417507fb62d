// SPDX-License-Identifier: MIT
// Saved worlds: changes to the bytes of a real one (support/input.h), with a checksum that is right. What is loaded
// is stepped, saved and loaded again.
#include "support/grounds.h"
#include "support/input.h"
#include "world/world_bytes.h"

#include <terrane/collision/world.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace terrane;
using fuzz::require;

namespace {

constexpr std::size_t kChecksumBytes = 8;

const Ground& hills() {
    static const Ground ground = test::make_test_ground(
        [](double x, double y) { return 2.0 * std::sin(0.11 * x) * std::sin(0.07 * y); }, 1.0, 1);
    return ground;
}

BodyState at(const WorldPos& place) {
    BodyState state;
    state.pose.translation = place;
    return state;
}

/// Bodies of every shape and type, a sensor, a vehicle, a character, a removed slot, contacts.
World make_world() {
    World world = World::create({.report_contacts = true}).value();
    const std::vector<Eigen::Vector3d> corners{
        {-0.9, -0.6, -0.3}, {1.2, -0.7, -0.4}, {0.8, 0.9, -0.3}, {-0.5, 0.1, 0.9}};
    const ConvexHull wedge = ConvexHull::create(corners).value();
    const std::vector<CompoundPart> parts{{Box{{0.3, 0.8, 0.3}}, {}}, {wedge, {}}};
    const Compound compound = Compound::create(parts).value();
    const BodyId removed = world.add({.shape = Sphere{}}, at({20.0, 20.0, 9.0})).value();
    const BodyId forced = world.add({.shape = Capsule{}}, at({60.0, 60.0, 4.0})).value();
    world.add({.shape = Box{}}, at({60.3, 60.2, 3.0})).value();
    world.add({.shape = wedge}, at({60.0, 60.5, 5.5})).value();
    world.add({.shape = compound}, at({61.0, 60.0, 7.0})).value();
    world.add({.shape = Box{{3.0, 3.0, 1.0}}, .type = BodyType::static_body}, at({60.0, 60.0, 1.0}))
        .value();
    BodySettings gate{.shape = Sphere{3.0}, .type = BodyType::static_body};
    gate.is_sensor = true;
    world.add(gate, at({60.0, 60.0, 3.0})).value();
    const BodyId lift = world
                            .add({.shape = Box{{2.0, 2.0, 0.2}}, .type = BodyType::kinematic_body},
                                 at({80.0, 80.0, 6.0}))
                            .value();
    Pose beside;
    beside.translation = {40.0, 62.0, 4.0};
    world.add_vehicle(make_truck(), beside).value();
    world.add_character({}, {50.0, 64.0, 5.0}).value();
    require(world.remove(removed).has_value(), "a body can be removed");
    for (int step = 0; step < 40; ++step) world.step(hills(), 1.0 / 60.0);
    beside.translation = {80.0, 80.0, 7.0};
    require(world.move_kinematic(lift, beside, 0.5).has_value(), "a body can be moved");
    require(world.add_force(forced, {5.0, 1.0, 3.0}).has_value(), "a body can be pushed");
    return world;
}

std::vector<std::uint8_t> bytes_of_world() {
    std::vector<std::uint8_t> bytes;
    for (const std::byte byte : make_world().save()) {
        bytes.push_back(std::to_integer<std::uint8_t>(byte));
    }
    bytes.resize(bytes.size() - kChecksumBytes);
    return bytes;
}

std::vector<std::byte> with_checksum(const std::vector<std::uint8_t>& bytes) {
    std::vector<std::byte> file;
    for (const std::uint8_t byte : bytes) file.push_back(std::byte{byte});
    const std::uint64_t checksum = internal::checksum_of(file);
    for (unsigned i = 0; i < kChecksumBytes; ++i)
        file.push_back(std::byte(checksum >> (8 * i) & 0xff));
    return file;
}

void check_states(const World& world) {
    for (const BodyState& state : world.states()) {
        if (state.condition == BodyCondition::removed) continue;
        require(state.pose.translation.allFinite() && state.velocity.allFinite() &&
                    state.angular_velocity.allFinite(),
                "states are finite");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::vector<std::uint8_t> saved = bytes_of_world();
    fuzz::Input input(data, size);
    const int steps = input.below(4);
    Result<World> world = World::load(with_checksum(fuzz::patched(saved, input)));
    if (!fuzz::is_accepted(world)) return 0;
    const std::vector<std::byte> again = world->save();
    const Result<World> same = World::load(again);
    if (!same) require(false, "what is saved can be loaded: " + same.error().message);
    require(same->save() == again, "a world that was loaded has the same bytes");
    check_states(*world);
    for (int step = 0; step < steps; ++step) world->step(hills(), 1.0 / 60.0);
    if (steps > 0) check_states(*world);
    const auto ray = world->ray(hills(), {60.0, 60.0, 50.0}, {60.0, 60.0, -50.0});
    require(ray.fraction >= 0.0 && ray.fraction <= 1.0, "a ray's fraction is 0 to 1");
    return 0;
}
