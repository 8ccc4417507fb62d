// SPDX-License-Identifier: MIT
#include "collision/world/busy_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace terrane::world_save_test {

using namespace test;

constexpr std::size_t kChecksumBytes = 8;

using Bytes = std::vector<std::byte>;

World load(const Bytes& bytes, const WorldCallbacks& callbacks = {}, int worker_count = 1) {
    return World::load(bytes, callbacks, worker_count).value();
}

/// Updates the checksum to match the bytes.
void repair_checksum(Bytes& bytes) {
    const std::size_t end = bytes.size() - kChecksumBytes;
    Hash hash;
    hash.add_all(std::span<const std::byte>(bytes).first(end));
    for (std::size_t i = 0; i < kChecksumBytes; ++i) {
        bytes[end + i] = std::byte(hash.value() >> (8 * i) & 0xff);
    }
}

// A copy that is loaded anew before every step needs all of its state; one that is loaded seldom goes on for long.
TEST(WorldSave, ALoadedWorldGoesOnWithTheSameBitsAndEvents) {
    struct Case {
        BroadphaseKind kind;
        int steps_between_loads;
    };
    const Ground ground = make_busy_ground();
    for (const auto& [kind, steps_between_loads] :
         {Case{BroadphaseKind::sap, 1}, Case{BroadphaseKind::grid, 1},
          Case{BroadphaseKind::two_scene, 1}, Case{BroadphaseKind::sap, 20}}) {
        World world = make_world({.report_contacts = true, .broadphase = kind});
        const BusyBodies bodies = fill_busy_world(world);
        World copy = load(world.save());
        std::uint64_t asleep = 0, parked = 0, placed_deep = 0, left = 0, events = 0;
        for (int step = 0; step < few_or_many(130, 260); ++step) {
            SCOPED_TRACE(testing::Message() << to_string(kind) << ", step " << step);
            act_on_busy_world(world, bodies, step);
            act_on_busy_world(copy, bodies, step);
            const StepReport report = world.step(ground, kStep);
            ASSERT_TRUE(report == copy.step(ground, kStep));
            ASSERT_EQ(copy.state_hash(), world.state_hash());
            expect_same_events(world, copy);
            ASSERT_EQ(copy.save(), world.save());
            if (step % steps_between_loads == 0) copy = load(copy.save(), {}, 1 + step % 3);
            asleep += report.asleep;
            parked += report.parked;
            placed_deep += report.placed_deep;
            left += report.left_world;
            events += world.contact_events().size();
        }
        for (const std::uint64_t met : {asleep, parked, placed_deep, left, events}) {
            EXPECT_GT(met, 0u);
        }
    }
}

TEST(WorldSave, IsNotNoticedInACrowd) {
    const Ground ground = make_flat();
    SeededRandom random(6);
    World world = make_world();
    for (int i = 0; i < 200; ++i) {  // rods: most pairs with overlapping boxes do not touch
        BodyState state = at(Eigen::Vector3d(60.0, 60.0, 9.0) + 0.5 * random.direction());
        state.pose.rotation = random.rotation();
        add(world, {.shape = Capsule{0.01, 1.0}}, state);
    }
    std::uint64_t skipped = 0;
    World copy = load(world.save());
    for (int step = 0; step < 10; ++step) {
        const StepReport report = world.step(ground, kStep);
        ASSERT_TRUE(report == copy.step(ground, kStep)) << step;
        ASSERT_EQ(copy.state_hash(), world.state_hash()) << step;
        skipped += report.skipped_pairs;
        copy = load(copy.save());
    }
    EXPECT_GT(skipped, 0u);
}

TEST(WorldSave, KeepsSleepersAsleepAndTheirContacts) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    BodySettings sensor{.shape = Sphere{2.0}, .type = BodyType::static_body, .is_sensor = true};
    add(world, sensor, at({60.0, 60.0, 6.0}));
    BodyId top;
    for (int i = 0; i < 3; ++i) {
        top = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5 + i}));
    }
    for (int step = 0; step < 200; ++step) world.step(ground, kStep);
    World loaded = load(world.save());
    for (int step = 0; step < 3; ++step) {
        const StepReport report = loaded.step(ground, kStep);
        EXPECT_EQ(report.asleep, 3u);
        EXPECT_TRUE(report == world.step(ground, kStep));
        EXPECT_TRUE(loaded.contact_events().empty());
        EXPECT_EQ(loaded.save(), world.save());
    }
    for (World* each : {&world, &loaded}) {
        ASSERT_TRUE(each->apply_impulse(top, {60.0, 60.0, 8.0}, {0.0, 0.0, 3.0}));
        for (int step = 0; step < 10; ++step) each->step(ground, kStep);
    }
    EXPECT_EQ(loaded.state_hash(), world.state_hash());
    expect_same_events(world, loaded);
}

TEST(WorldSave, KeepsIdsTheirGenerationsAndTheOrderOfFreeSlots) {
    World world = make_world();
    const BusyBodies bodies = fill_busy_world(world);
    World loaded = load(world.save());
    EXPECT_FALSE(loaded.contains(bodies.removed));
    EXPECT_TRUE(loaded.contains(bodies.lift));
    for (int i = 0; i < 5; ++i) {
        const BodyId in_world = add(world, {}, at({90.0, 20.0, 30.0 + 2.0 * i}));
        EXPECT_EQ(add(loaded, {}, at({90.0, 20.0, 30.0 + 2.0 * i})), in_world);
    }
    EXPECT_EQ(loaded.save(), world.save());
}

TEST(WorldSave, AsksForTheCallbacksThatTheWorldHad) {
    WorldSettings settings;
    settings.callbacks.gravity_at = [](const WorldPos&) { return Eigen::Vector3d(0, 0, -3.0); };
    World world = make_world(settings);
    const BodyId body = add(world, {}, at({60.0, 60.0, 10.0}));
    const Bytes bytes = world.save();
    for (const WorldCallbacks& others :
         {WorldCallbacks{},
          WorldCallbacks{settings.callbacks.gravity_at, [](BodyId, BodyId) { return true; }}}) {
        const Result<World> loaded = World::load(bytes, others);
        ASSERT_FALSE(loaded);
        EXPECT_EQ(loaded.error().code, ErrorCode::invalid_argument) << loaded.error().message;
    }
    EXPECT_EQ(World::load(bytes, settings.callbacks, 0).error().code, ErrorCode::invalid_argument);
    World loaded = load(bytes, settings.callbacks);
    const Ground ground = make_busy_ground();
    loaded.step(ground, 0.5);
    world.step(ground, 0.5);
    EXPECT_EQ(loaded.state_hash(), world.state_hash());
    EXPECT_NEAR(loaded.state(body).velocity.z(), -1.5, 1e-12);
}

TEST(WorldSave, WritesHullsAndCompoundsThatBodiesShareOnce) {
    World world = make_world();
    const Shape hull = make_wedge(), compound = make_hammer();
    for (const Shape& shape : {hull, compound, hull, compound}) {
        add(world, {.shape = shape}, at({60.0, 60.0, 10.0}));
    }
    World apart = make_world();
    for (int i = 0; i < 2; ++i) {
        add(apart, {.shape = make_wedge()}, at({60.0, 60.0, 10.0}));
        add(apart, {.shape = make_hammer()}, at({60.0, 60.0, 10.0}));
    }
    EXPECT_LT(world.save().size() + 400, apart.save().size());
    EXPECT_EQ(load(world.save()).save(), world.save());
}

/// A saved world with every kind of field, captured in motion.
Bytes make_bytes() {
    World world = make_world({.report_contacts = true});
    const BusyBodies bodies = fill_busy_world(world);
    const Ground ground = make_busy_ground();
    for (int step = 0; step <= 63; ++step) {
        act_on_busy_world(world, bodies, step);
        if (step < 63) world.step(ground, kStep);
    }
    return world.save();
}

TEST(WorldSave, NamesWhatIsWrongWithBytes) {
    const Bytes bytes = make_bytes();
    struct Case {
        void (*change)(Bytes&);
        bool is_checksum_right;
        const char* what;
    };
    for (const auto& [change, is_checksum_right, what] : {
             Case{[](Bytes& b) { b.clear(); }, false, "too short"},
             Case{[](Bytes& b) { b.assign(100, std::byte{7}); }, false, "not of a world"},
             Case{[](Bytes& b) { b[200] ^= std::byte{1}; }, false, "checksum"},
             Case{[](Bytes& b) { b[8] = std::byte{9}; }, true, "version must be 1, got 9"},
             Case{[](Bytes& b) { b.insert(b.end() - kChecksumBytes, std::byte{0}); }, true,
                  "end must come after the last field"},
             Case{[](Bytes& b) { std::fill_n(b.begin() + 14, 8, std::byte{0xff}); }, true,
                  "gravity must be"},  // gravity.x: NaN
         }) {
        Bytes changed = bytes;
        change(changed);
        if (is_checksum_right) repair_checksum(changed);
        const Result<World> world = World::load(changed);
        ASSERT_FALSE(world) << what;
        EXPECT_EQ(world.error().code, ErrorCode::bad_data);
        EXPECT_NE(world.error().message.find(what), std::string::npos) << world.error().message;
    }
}

TEST(WorldSave, ReadsTheFormerKindOfBroadphaseAsSap) {
    const Bytes sap = World::create({}).value().save();
    const Bytes two = World::create({.broadphase = BroadphaseKind::two_scene}).value().save();
    ASSERT_EQ(sap.size(), two.size());
    const auto kind = std::mismatch(sap.begin(), sap.end(), two.begin()).first - sap.begin();
    ASSERT_EQ(two[static_cast<std::size_t>(kind)], std::byte{2});
    EXPECT_EQ(load(two).save(), two);
    Bytes changed = sap;
    changed[static_cast<std::size_t>(kind)] = std::byte{3};
    repair_checksum(changed);
    EXPECT_EQ(load(changed).save(), sap);
    changed[static_cast<std::size_t>(kind)] = std::byte{4};
    repair_checksum(changed);
    EXPECT_FALSE(World::load(changed));
}

TEST(WorldSave, RefusesEveryTruncation) {
    const Bytes bytes = make_bytes();
    for (std::size_t size = 0; size < bytes.size(); size += size < 2000 ? 1 : 37) {
        Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        ASSERT_FALSE(World::load(cut)) << size;
        if (size < 20) continue;
        repair_checksum(cut);
        ASSERT_FALSE(World::load(cut)) << size;
    }
}

TEST(WorldSave, GivesAnErrorOrAWorldThatStepsForBytesWithErrors) {
    const Bytes bytes = make_bytes();
    const Ground ground = make_busy_ground();
    SeededRandom random(4711);
    const int count = few_or_many(1'200, 10'000);
    int refused = 0, stepped = 0;
    for (int i = 0; i < count; ++i) {
        Bytes changed = bytes;
        const int flips = 1 + random.below(3);
        for (int flip = 0; flip < flips; ++flip) {
            const int place = random.below(static_cast<int>(bytes.size()));
            changed[static_cast<std::size_t>(place)] = std::byte(random.below(256));
        }
        if (i % 4 == 0) {
            ASSERT_TRUE(changed == bytes || !World::load(changed)) << i;
            continue;
        }
        repair_checksum(changed);
        Result<World> world = World::load(changed);
        if (!world) {
            ++refused;
            EXPECT_NE(world.error().message, "");
            continue;
        }
        ASSERT_EQ(load(world->save()).save(), world->save()) << i;
        if (i % 20 > 1) continue;
        ++stepped;
        for (int step = 0; step < 3; ++step) world->step(ground, kStep);
        world->ray(ground, {60.0, 60.0, 30.0}, {61.0, 60.0, -30.0});
    }
    EXPECT_GT(refused, count / 10);
    EXPECT_GT(stepped, count / 100);
}

}  // namespace terrane::world_save_test
