// SPDX-License-Identifier: MIT
#include "adapter_grounds.h"
#include "mujoco_stub.h"
#include "support/random.h"

#include <terrane/adapters/mujoco_window.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace terrane::adapters {
namespace mujoco_window_test {

using test::MujocoStub;
using Window = MujocoWindow<MujocoStub::Model, MujocoStub::Data>;
using Status = MujocoWindowStatus;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Every sample of the hfield that a cell of ground touches is the ground, to the rounding of a float.
void expect_ground(const MujocoStub& stub, const Ground& ground, const WorldPos& origin,
                   double range) {
    for (int row = 0; row < stub.side(); ++row) {
        for (int column = 0; column < stub.side(); ++column) {
            const HeightAnswer want =
                ground.height(origin.x() + stub.x(column), origin.y() + stub.y(row));
            if (want.status != GroundStatus::ok) continue;
            ASSERT_NEAR(stub.height(column, row), want.height - origin.z(), range * 0x1p-25 + 1e-9)
                << column << ' ' << row;
        }
    }
}

TEST(MujocoWindow, HoldsTheGroundAroundTheBodiesWhereverTheyGo) {
    const Ground ground = test::make_test_ground(test::rough_height);
    MujocoStub stub(33, 1.0, 40.0, 2);
    Window window = Window::create(stub.model, 0, {.margin = 4}).value();
    test::Random random(31);
    double x = 64.0, y = 64.0;
    int changes = 0;
    for (int i = 0; i < 200; ++i) {
        x = std::clamp(x + random.between(-3.0, 3.0), 25.0, 103.0);
        y = std::clamp(y + random.between(-3.0, 3.0), 25.0, 103.0);
        stub.put_ball(0, x, y, 30.0);
        stub.put_ball(1, x + 5.0, y - 5.0, 30.0);
        const MujocoWindowUpdate update = window.update(stub.model, stub.data, ground);
        ASSERT_EQ(update.status, Status::ok);
        EXPECT_TRUE(update.covers_boxes);
        EXPECT_EQ(update.unsupported_boxes, 0);
        changes += update.has_changed ? 1 : 0;
        expect_ground(stub, ground, WorldPos::Zero(), 40.0);
    }
    EXPECT_GT(changes, 5);
    EXPECT_LT(changes, 100);  // far from one for each step
}

TEST(MujocoWindow, NormalisesHeightsFromTheLowestGroundOfTheWindow) {
    const Ground ground = test::make_test_ground(test::plane_height);
    MujocoStub stub(17, 1.0, 40.0, 1);
    stub.put_ball(0, 64.0, 64.0, 30.0);
    Window window = Window::create(stub.model, 0, {.margin = 2}).value();
    const MujocoWindowUpdate update = window.update(stub.model, stub.data, ground);
    EXPECT_EQ(update.height_range, 16 * 0.25 + 16 * 0.125);
    EXPECT_EQ(stub.data.mocap_pos[2],
              stub.height(0, 16));  // the south-west rises to the east, falls to the north
    EXPECT_EQ(stub.height(0, 16), test::plane_height(stub.x(0), stub.y(16)));
    EXPECT_EQ(update.surface_error_m, 40.0 * 0x1p-25);  // a plane has no twist
    for (int i = 0; i < 17 * 17; ++i) {
        EXPECT_GE(stub.model.hfield_data[i], 0.0f);
        EXPECT_LE(stub.model.hfield_data[i], 1.0f);
    }
}

TEST(MujocoWindow, BoundsTheDifferenceOfTheTwoWaysToCutACell) {
    const Ground ground = test::make_test_ground(test::rough_height);
    MujocoStub stub(33, 1.0, 40.0, 1);
    stub.put_ball(0, 64.0, 64.0, 30.0);
    Window window = Window::create(stub.model, 0, {}).value();
    const double bound = window.update(stub.model, stub.data, ground).surface_error_m;
    double largest = 0.0;
    test::Random random(37);
    for (int i = 0; i < 20'000; ++i) {
        const double u = random.between(0.0, 32.0), v = random.between(0.0, 32.0);
        const int column = static_cast<int>(u), row = static_cast<int>(v);
        const double fx = u - column, fy = v - row;
        const double sw = stub.height(column, row), ne = stub.height(column + 1, row + 1);
        const double se = stub.height(column + 1, row), nw = stub.height(column, row + 1);
        // MuJoCo's triangles: south-west, north-east, and one of the other corners
        const double z =
            fx >= fy ? sw + fx * (se - sw) + fy * (ne - se) : sw + fy * (nw - sw) + fx * (ne - nw);
        const double x = stub.x(0) + u, y = stub.y(0) + v;
        largest = std::max(largest, std::abs(z - ground.height(x, y).height));
    }
    EXPECT_LE(largest, bound * (1 + 1e-9));
    EXPECT_GT(largest, 0.5 * bound);  // the bound is one of the cells that are there
}

TEST(MujocoWindow, PutsAbsentGroundAtTheBottomAndCountsTheBodiesOverIt) {
    const Ground ground = test::make_broken_ground();  // x < 8 outside, the north-east not resident
    MujocoStub stub(33, 1.0, 40.0, 2);
    Window window = Window::create(stub.model, 0, {.margin = 4}).value();
    stub.put_ball(0, 20.0, 40.0, 30.0);
    stub.put_ball(1, 12.0, 40.0, 30.0);
    EXPECT_EQ(window.update(stub.model, stub.data, ground).unsupported_boxes, 0);
    stub.put_ball(1, 8.3, 40.0, 30.0);  // its box reaches over the edge
    const MujocoWindowUpdate edge = window.update(stub.model, stub.data, ground);
    EXPECT_EQ(edge.unsupported_boxes, 1);
    EXPECT_GT(edge.absent_cells, 0);
    expect_ground(stub, ground, WorldPos::Zero(), 40.0);
    ASSERT_LT(stub.x(0), 7.0);
    for (int row = 0; row < 33; ++row) EXPECT_EQ(stub.model.hfield_data[33 * row], 0.0f);
    stub.put_ball(0, 128.0, 128.0, 30.0);
    stub.put_ball(1, 120.0, 120.0, 30.0);
    EXPECT_EQ(window.update(stub.model, stub.data, ground).unsupported_boxes, 1);
}

TEST(MujocoWindow, SaysThatThereIsNoGroundAtAll) {
    MujocoStub stub(33, 1.0, 40.0, 1);
    Window window = Window::create(stub.model, 0, {}).value();
    stub.put_ball(0, 200.0, 200.0, 0.0);
    const MujocoWindowUpdate absent =
        window.update(stub.model, stub.data, test::make_broken_ground());
    EXPECT_EQ(absent.status, Status::no_ground);
    EXPECT_EQ(absent.unsupported_boxes, 1);
    // the window stays within the extent
    stub.put_ball(0, -1e9, 1e9, 0.0);
    EXPECT_EQ(window.update(stub.model, stub.data, test::make_broken_ground()).unsupported_boxes,
              1);
    test::TableGroundSettings whole;
    whole.roots = 2;
    stub.put_ball(0, 200.0, 200.0, 0.0);
    const Ground arrived = test::make_test_ground(test::plane_height, whole);
    EXPECT_EQ(window.update(stub.model, stub.data, arrived).status, Status::ok);
    expect_ground(stub, arrived, WorldPos::Zero(), 40.0);
}

TEST(MujocoWindow, LeavesTheFieldAloneWhereItsRangeIsTooSmall) {
    const Ground ground =
        test::make_test_ground([](double x, double) { return x < 80 ? 0.0 : 50.0; });
    MujocoStub stub(17, 1.0, 40.0, 1);
    Window window = Window::create(stub.model, 0, {.margin = 2}).value();
    stub.put_ball(0, 60.0, 60.0, 1.0);
    ASSERT_EQ(window.update(stub.model, stub.data, ground).status, Status::ok);
    const double x = stub.data.mocap_pos[0];
    stub.put_ball(0, 80.0, 60.0, 1.0);
    const MujocoWindowUpdate cliff = window.update(stub.model, stub.data, ground);
    EXPECT_EQ(cliff.status, Status::too_high);
    EXPECT_FALSE(cliff.has_changed);
    EXPECT_EQ(cliff.height_range, 50.0);
    EXPECT_EQ(cliff.unsupported_boxes, 1);
    EXPECT_EQ(stub.data.mocap_pos[0], x);
    stub.put_ball(0, 110.0, 60.0, 51.0);
    EXPECT_EQ(window.update(stub.model, stub.data, ground).status, Status::ok);
    expect_ground(stub, ground, WorldPos::Zero(), 40.0);
}

TEST(MujocoWindow, RefusesGroundOfAnotherSpacingAndBodiesThatAreNowhere) {
    MujocoStub stub(17, 0.5, 40.0, 1);
    Window window = Window::create(stub.model, 0, {.margin = 2}).value();
    const Ground ground = test::make_test_ground(test::plane_height);
    EXPECT_EQ(window.update(stub.model, stub.data, ground).status, Status::wrong_spacing);
    const Ground fine = test::make_test_ground(test::plane_height, 0.5, 1);
    stub.put_ball(0, kNan, 10.0, 0.0);
    const MujocoWindowUpdate nowhere = window.update(stub.model, stub.data, fine);
    EXPECT_EQ(nowhere.status, Status::no_bodies);
    EXPECT_EQ(nowhere.unsupported_boxes, 1);
    EXPECT_FALSE(nowhere.has_changed);
    MujocoStub empty(17, 1.0, 40.0, 0);
    Window no_bodies = Window::create(empty.model, 0, {.margin = 2}).value();
    EXPECT_EQ(no_bodies.update(empty.model, empty.data, ground).status, Status::no_bodies);
}

TEST(MujocoWindow, KeepsItsPrecisionAMillionKilometresOut) {
    const Ground ground = test::make_far_ground();
    const WorldPos origin(1e9, -1e9, 1e5);
    MujocoStub stub(33, 1.0, 40.0, 1);
    Window window = Window::create(stub.model, 0, {.origin_world = origin}).value();
    stub.put_ball(0, 64.0, 60.0, 20.0);
    ASSERT_EQ(window.update(stub.model, stub.data, ground).status, Status::ok);
    expect_ground(stub, ground, origin, 40.0);
    EXPECT_NEAR(stub.height(16, 16), test::plane_height(stub.x(16), stub.y(16)), 1e-3);
}

TEST(MujocoWindow, CountsBodiesOverVolumes) {
    MujocoStub stub(33, 1.0, 40.0, 1);
    Window window = Window::create(stub.model, 0, {}).value();
    test::TableGroundSettings settings;
    settings.solid = [](const Chunk&) {
        SolidTriangles pit;  // of which only the hole in the heightfield matters here
        pit.replaced = {static_cast<std::uint16_t>(2 * cell_index(50, 50)),
                        static_cast<std::uint16_t>(2 * cell_index(50, 50) + 1)};
        return std::make_shared<const SolidSurface>(std::move(pit));
    };
    const Ground ground = test::make_test_ground([](double, double) { return 20.0; }, settings);
    stub.put_ball(0, 50.5, 50.5, 21.0);
    EXPECT_EQ(window.update(stub.model, stub.data, ground).boxes_over_volumes, 1);
    stub.put_ball(0, 53.5, 50.5, 21.0);
    EXPECT_EQ(window.update(stub.model, stub.data, ground).boxes_over_volumes, 0);
}

TEST(MujocoWindow, RefusesGeomsThatCannotMove) {
    MujocoStub stub(17, 1.0, 40.0, 1);
    EXPECT_FALSE(Window::create(stub.model, -1, {}));
    EXPECT_FALSE(Window::create(stub.model, 1, {}));  // a ball
    EXPECT_FALSE(Window::create(stub.model, 2, {}));
    EXPECT_FALSE(Window::create(stub.model, 0, {.origin_world = {kNan, 0, 0}}));
    EXPECT_FALSE(Window::create(stub.model, 0, {.margin = -1}));
    EXPECT_FALSE(Window::create(stub.model, 0, {.margin = 8}));  // half of the window
    stub.model.geom_pos[2] = 1.0;
    EXPECT_FALSE(Window::create(stub.model, 0, {}));
    stub.model.geom_pos[2] = 0.0;
    stub.model.geom_quat[3] = 1.0;
    EXPECT_FALSE(Window::create(stub.model, 0, {}));
    stub.model.geom_quat[3] = 0.0;
    stub.model.body_mocapid[1] = -1;
    const Result<Window> fixed = Window::create(stub.model, 0, {});
    ASSERT_FALSE(fixed);
    EXPECT_EQ(fixed.error().message, "the hfield geom 0 must be on a mocap body");
    stub.model.body_mocapid[1] = 0;
    for (const int side : {0, 1, 1'000'000'000}) {
        stub.model.hfield_ncol[0] = side;
        EXPECT_FALSE(Window::create(stub.model, 0, {})) << side;
    }
}

}  // namespace mujoco_window_test
}  // namespace terrane::adapters
