// SPDX-License-Identifier: MIT
#include "adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/dart_window.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace terrane::adapters {
namespace dart_window_test {

// What a DartWindow uses of dart::dynamics::HeightmapShape, written from its documentation.
struct ShapeStub {
    using Vector3 = Eigen::Matrix<float, 3, 1>;
    using HeightField = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    // NOLINTBEGIN(readability-identifier-naming): DART's names
    void setScale(const Vector3& value) { scale = value; }
    void setHeightField(const HeightField& value) {
        heights = value;
        ++version;
    }
    // NOLINTEND(readability-identifier-naming)

    Vector3 scale = Vector3::Ones();
    HeightField heights;
    int version = 0;
};

using Window = DartWindow<ShapeStub>;
using Status = DartWindowStatus;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Aabb box_at(double x, double y) { return {{x - 0.5, y - 0.5, 0.0}, {x + 0.5, y + 0.5, 1.0}}; }

// Every sample of the shape over ground, placed as DART places it, is the ground.
void expect_ground(const ShapeStub& shape, const Eigen::Vector3d& translation_sim,
                   const Ground& ground, const WorldPos& origin) {
    const double half_x = 0.5 * static_cast<double>(shape.heights.cols() - 1);
    const double half_y = 0.5 * static_cast<double>(shape.heights.rows() - 1);
    for (Eigen::Index row = 0; row < shape.heights.rows(); ++row) {
        for (Eigen::Index column = 0; column < shape.heights.cols(); ++column) {
            const double x = (static_cast<double>(column) - half_x) * shape.scale.x();
            const double y = (half_y - static_cast<double>(row)) * shape.scale.y();
            const WorldPos p = origin + translation_sim + Eigen::Vector3d(x, y, 0.0);
            const HeightAnswer want = ground.height(p.x(), p.y());
            if (want.status != GroundStatus::ok) continue;
            ASSERT_NEAR(p.z() + shape.heights(row, column), want.height, 2e-6)
                << row << ' ' << column;
        }
    }
}

TEST(DartWindow, HoldsTheGroundAroundTheBodiesWhereverTheyGo) {
    const Ground ground = test::make_test_ground(test::rough_height);
    ShapeStub shape;
    Window window = Window::create({.columns = 32, .rows = 24, .margin = 4}).value();
    test::Random random(43);
    double x = 64.0, y = 64.0;
    for (int i = 0; i < 150; ++i) {
        x = std::clamp(x + random.between(-3.0, 3.0), 25.0, 103.0);
        y = std::clamp(y + random.between(-3.0, 3.0), 25.0, 103.0);
        const std::array boxes{box_at(x, y), box_at(x + 3.0, y - 2.0)};
        const DartWindowUpdate update = window.update(shape, ground, boxes);
        ASSERT_EQ(update.status, Status::ok);
        EXPECT_TRUE(update.covers_boxes);
        EXPECT_EQ(update.unsupported_boxes, 0);
        ASSERT_EQ(shape.heights.rows(), 25);
        ASSERT_EQ(shape.heights.cols(), 33);
        expect_ground(shape, update.translation_sim, ground, WorldPos::Zero());
    }
    EXPECT_GT(shape.version, 3);
    EXPECT_LT(shape.version, 75);  // far from one for each step
}

TEST(DartWindow, GivesTheShapeNothingNewWhereNothingChanged) {
    const Ground ground = test::make_test_ground(test::rough_height);
    ShapeStub shape;
    Window window = Window::create({}).value();
    const std::array boxes{box_at(64, 64)};
    EXPECT_TRUE(window.update(shape, ground, boxes).has_changed);
    EXPECT_FALSE(window.update(shape, ground, boxes).has_changed);
    EXPECT_EQ(shape.version, 1);
}

TEST(DartWindow, CountsBodiesOverAbsentGround) {
    const Ground ground = test::make_broken_ground();
    ShapeStub shape;
    Window window = Window::create({.columns = 32, .rows = 32, .margin = 4}).value();
    const std::array edge{box_at(8.2, 40.0), box_at(20.0, 40.0)};
    const DartWindowUpdate update = window.update(shape, ground, edge);
    EXPECT_EQ(update.unsupported_boxes, 1);
    EXPECT_GT(update.absent_cells, 0);
    EXPECT_GE(shape.heights.minCoeff(), 0.0f);
    expect_ground(shape, update.translation_sim, ground, WorldPos::Zero());
    const std::array absent{box_at(200, 200), Aabb{{kNan, 0, 0}, {1, 1, 1}}};
    const DartWindowUpdate none = window.update(shape, ground, absent);
    EXPECT_EQ(none.status, Status::no_ground);
    EXPECT_EQ(none.unsupported_boxes, 2);
    EXPECT_EQ(shape.heights.maxCoeff(), 0.0f);
}

TEST(DartWindow, DoesNothingWithoutABody) {
    ShapeStub shape;
    Window window = Window::create({}).value();
    const Ground ground = test::make_test_ground(test::plane_height);
    const std::array bad{Aabb{{kNan, 0, 0}, {1, 1, 1}}};
    EXPECT_EQ(window.update(shape, ground, bad).status, Status::no_bodies);
    EXPECT_EQ(window.update(shape, ground, {}).status, Status::no_bodies);
    EXPECT_EQ(shape.version, 0);
}

TEST(DartWindow, KeepsItsPrecisionAMillionKilometresOut) {
    const WorldPos origin(1e9, -1e9, 1e5);
    const Ground ground = test::make_far_ground();
    ShapeStub shape;
    Window window = Window::create({.columns = 32, .rows = 32, .origin_world = origin}).value();
    const std::array boxes{box_at(64, 60)};
    const DartWindowUpdate update = window.update(shape, ground, boxes);
    ASSERT_EQ(update.status, Status::ok);
    expect_ground(shape, update.translation_sim, ground, origin);
}

TEST(DartWindow, RefusesWindowsOfNoCellsAndOfABillion) {
    EXPECT_FALSE(Window::create({.columns = 0}));
    EXPECT_FALSE(Window::create({.rows = -1}));
    EXPECT_FALSE(Window::create({.columns = 1'000'000'000, .rows = 1'000'000'000}));
    EXPECT_FALSE(Window::create({.columns = 16, .rows = 16, .margin = 8}));
    EXPECT_FALSE(Window::create({.origin_world = {0, 0, kNan}}));
}

}  // namespace dart_window_test
}  // namespace terrane::adapters
