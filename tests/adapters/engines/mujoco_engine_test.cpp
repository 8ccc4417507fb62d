// SPDX-License-Identifier: MIT
//
// MuJoCo itself on a window of ground: where its rays hit, where its bodies come to rest, and that a move of the window
// is not felt.
#include "adapters/adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/mujoco_window.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>

#if TERRANE_TEST_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace terrane::adapters {
namespace mujoco_engine_test {

#if TERRANE_TEST_MUJOCO

using Window = MujocoWindow<mjModel, mjData>;

// A model with an hfield on a mocap body and one free ball, in a step of 2 ms.
struct Simulation {
    Simulation(std::int32_t cells, double range, const WorldPos& ball) {
        const MujocoHfieldXml field = hfield_xml("ground", cells, 1.0, range, 5.0);
        char name[] = "/tmp/terrane_mujoco_XXXXXX";
        const int file = mkstemp(name);
        if (file >= 0) std::fclose(fdopen(file, "w"));
        std::ofstream(name)
            << "<mujoco><option timestep=\"0.002\"/><asset>" << field.asset << "</asset><worldbody>"
            << field.body << "<body name=\"ball\" pos=\"" << ball.x() << ' ' << ball.y() << ' '
            << ball.z()
            << "\"><freejoint/><geom type=\"sphere\" size=\"0.5\" condim=\"6\" friction=\"1 0.005 "
               "0.0001\"/></body></worldbody></mujoco>";
        char error[500] = "";
        model = mj_loadXML(name, nullptr, error, sizeof error);
        std::remove(name);
        if (model == nullptr) {
            std::fprintf(stderr, "MuJoCo refused the model: %s\n", error);
            std::abort();
        }
        data = mj_makeData(model);
        mj_forward(model, data);
        geom = mj_name2id(model, mjOBJ_GEOM, "ground");
    }
    ~Simulation() {
        mj_deleteData(data);
        mj_deleteModel(model);
    }
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    Eigen::Vector3d ball() const { return {data->qpos[0], data->qpos[1], data->qpos[2]}; }
    // z of the first hit of a vertical ray from above with the hfield.
    double ray(double x, double y) const {
        const mjtNum from[3] = {x, y, 1000.0}, down[3] = {0.0, 0.0, -1.0};
        return 1000.0 - mj_rayHfield(model, data, geom, from, down);
    }

    mjModel* model = nullptr;
    mjData* data = nullptr;
    int geom = -1;
};

TEST(MujocoEngine, SeesTheGroundWithinTheErrorThatTheWindowTells) {
    const Ground ground = test::make_test_ground(test::rough_height);
    Simulation simulation(32, 40.0, {60.0, 70.0, 30.0});
    Window window = Window::create(*simulation.model, simulation.geom, {}).value();
    const MujocoWindowUpdate update = window.update(*simulation.model, *simulation.data, ground);
    ASSERT_EQ(update.status, MujocoWindowStatus::ok);
    EXPECT_TRUE(update.has_changed);
    mj_forward(simulation.model, simulation.data);
    test::Random random(41);
    double largest = 0.0;
    for (int i = 0; i < 2000; ++i) {
        const double x = 60.0 + random.between(-14.0, 14.0), y = 70.0 + random.between(-14.0, 14.0);
        const double off = std::abs(simulation.ray(x, y) - ground.height(x, y).height);
        ASSERT_LE(off, update.surface_error_m + 1e-6) << x << ' ' << y;
        largest = std::max(largest, off);
    }
    EXPECT_GT(largest, 0.3 * update.surface_error_m);
}

TEST(MujocoEngine, RestsOnFlatGroundAtItsHeight) {
    const Ground ground = test::make_test_ground([](double, double) { return 12.0; });
    Simulation simulation(32, 40.0, {60.0, 70.0, 13.0});
    Window window = Window::create(*simulation.model, simulation.geom, {}).value();
    for (int i = 0; i < 1000; ++i) {
        ASSERT_EQ(window.update(*simulation.model, *simulation.data, ground).unsupported_boxes, 0);
        mj_step(simulation.model, simulation.data);
    }
    EXPECT_NEAR(simulation.ball().z(), 12.5, 5e-3);
    EXPECT_GT(simulation.data->ncon, 0);
}

TEST(MujocoEngine, DoesNotFeelThatTheWindowMoves) {
    const Ground ground = test::make_test_ground(test::plane_height);
    const WorldPos start(100.0, 30.0, test::plane_height(100.0, 30.0) + 0.55);
    Simulation small(24, 40.0, start), large(120, 60.0, start);
    Window moving = Window::create(*small.model, small.geom, {.margin = 4}).value();
    Window fixed = Window::create(*large.model, large.geom, {.margin = 4}).value();
    int moves = 0;
    for (int i = 0; i < 3000; ++i) {
        const MujocoWindowUpdate update = moving.update(*small.model, *small.data, ground);
        ASSERT_EQ(update.unsupported_boxes, 0);
        moves += update.has_changed && i > 0 ? 1 : 0;
        const MujocoWindowUpdate once = fixed.update(*large.model, *large.data, ground);
        ASSERT_EQ(once.status, MujocoWindowStatus::ok);
        ASSERT_EQ(once.has_changed, i == 0);
        mj_step(small.model, small.data);
        mj_step(large.model, large.data);
        ASSERT_LT((small.ball() - large.ball()).norm(), 0.02) << "step " << i;
    }
    EXPECT_GE(moves, 2);
    EXPECT_LT(small.ball().x(), 85.0);  // it has rolled down
}

TEST(MujocoEngine, PutsTheWindowBackAfterAReset) {
    const Ground ground = test::make_test_ground([](double, double) { return 12.0; });
    Simulation simulation(32, 40.0, {60.0, 70.0, 13.0});
    Window window = Window::create(*simulation.model, simulation.geom, {}).value();
    window.update(*simulation.model, *simulation.data, ground);
    mj_resetData(simulation.model, simulation.data);
    mj_forward(simulation.model, simulation.data);
    EXPECT_FALSE(window.update(*simulation.model, *simulation.data, ground).has_changed);
    mj_forward(simulation.model, simulation.data);
    EXPECT_NEAR(simulation.ray(60.0, 70.0), 12.0, 1e-5);
}

TEST(MujocoEngine, CountsOnlyBodiesThatCanMove) {
    Simulation simulation(32, 40.0, {60.0, 70.0, 13.0});
    const WorldPos origin(1000.0, 2000.0, 300.0);
    Window window =
        Window::create(*simulation.model, simulation.geom, {.origin_world = origin}).value();
    const std::span<const BodyNeed> needs = window.needs(*simulation.model, *simulation.data);
    ASSERT_EQ(needs.size(), 1u);
    EXPECT_EQ(needs[0].centre_world, origin + Eigen::Vector3d(60.0, 70.0, 13.0));
    EXPECT_EQ(needs[0].radius, 0.5);
}

#else

TEST(MujocoEngine, IsInstalled) {
    GTEST_SKIP() << "MuJoCo was not found: apt-get install libmujoco-dev";
}

#endif

}  // namespace mujoco_engine_test
}  // namespace terrane::adapters
