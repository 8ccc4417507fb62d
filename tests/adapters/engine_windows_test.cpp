// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/dart_window.h>
#include <terrane/adapters/mujoco_window.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::test {

/// The members of mjModel and mjData that a MujocoWindow uses, written from the documentation: one hfield geom on a
/// mocap body, and balls on bodies that move.
struct MujocoStub {
    struct Model {
        int ngeom = 0, nhfield = 1;
        int* geom_type = nullptr;
        int* geom_dataid = nullptr;
        int* geom_bodyid = nullptr;
        int* body_mocapid = nullptr;
        int* body_weldid = nullptr;
        double* geom_pos = nullptr;
        double* geom_quat = nullptr;
        double* geom_rbound = nullptr;
        double* hfield_size = nullptr;
        int* hfield_nrow = nullptr;
        int* hfield_ncol = nullptr;
        int* hfield_adr = nullptr;
        float* hfield_data = nullptr;
    };
    struct Data {
        double* geom_xpos = nullptr;
        double* mocap_pos = nullptr;
        double* mocap_quat = nullptr;
    };

    /// Body 1 and geom 0 are the hfield, body 2 + i and geom 1 + i ball i.
    MujocoStub(int side, double spacing, double range, int balls)
        : size_{0.5 * spacing * (side - 1), 0.5 * spacing * (side - 1), range, 4.0},
          nrow_(side),
          ncol_(side),
          heights_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side)),
          xpos_(static_cast<std::size_t>(3 + 3 * balls)),
          radius_(static_cast<std::size_t>(1 + balls), 0.5) {
        for (int i = 0; i < 1 + balls; ++i) {
            types_.push_back(i == 0 ? 1 : 2);
            hfields_.push_back(i == 0 ? 0 : -1);
            bodies_.push_back(i + 1);
            positions_.insert(positions_.end(), 3, 0.0);
            quats_.insert(quats_.end(), {1.0, 0.0, 0.0, 0.0});
        }
        for (int i = 0; i < 2 + balls; ++i) {
            mocap_ids_.push_back(i == 1 ? 0 : -1);
            welds_.push_back(i < 2 ? 0 : i);
        }
        model.ngeom = 1 + balls;
        model.geom_type = types_.data();
        model.geom_dataid = hfields_.data();
        model.geom_bodyid = bodies_.data();
        model.body_mocapid = mocap_ids_.data();
        model.body_weldid = welds_.data();
        model.geom_pos = positions_.data();
        model.geom_quat = quats_.data();
        model.geom_rbound = radius_.data();
        model.hfield_size = size_.data();
        model.hfield_nrow = &nrow_;
        model.hfield_ncol = &ncol_;
        model.hfield_adr = &first_;
        model.hfield_data = heights_.data();
        data.geom_xpos = xpos_.data();
        data.mocap_pos = mocap_pos_.data();
        data.mocap_quat = mocap_quat_.data();
    }
    MujocoStub(const MujocoStub&) = delete;
    MujocoStub& operator=(const MujocoStub&) = delete;
    ~MujocoStub() = default;

    void put_ball(int i, double x, double y, double z) {
        const auto at = static_cast<std::size_t>(3 * (i + 1));
        xpos_[at] = x;
        xpos_[at + 1] = y;
        xpos_[at + 2] = z;
    }
    /// Height of the hfield's surface at one of its samples, MuJoCo's frame.
    double height(int column, int row) const {
        const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(ncol_);
        return mocap_pos_[2] +
               size_[2] * static_cast<double>(heights_[at + static_cast<std::size_t>(column)]);
    }
    double x(int column) const {
        return mocap_pos_[0] - size_[0] + 2.0 * size_[0] * column / (ncol_ - 1);
    }
    double y(int row) const {
        return mocap_pos_[1] - size_[1] + 2.0 * size_[1] * row / (nrow_ - 1);
    }
    int side() const { return ncol_; }

    Model model;
    Data data;

private:
    std::vector<int> types_, hfields_, bodies_, mocap_ids_, welds_;
    std::vector<double> positions_, quats_;
    std::array<double, 4> size_;
    int nrow_, ncol_, first_ = 0;
    std::vector<float> heights_;
    std::vector<double> xpos_, radius_;
    std::array<double, 3> mocap_pos_{};
    std::array<double, 4> mocap_quat_{};
};

}  // namespace terrane::test

namespace terrane::adapters {
namespace mujoco_window_test {

using test::MujocoStub;
using Window = MujocoWindow<MujocoStub::Model, MujocoStub::Data>;
using Status = MujocoWindowStatus;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Every sample of the hfield that a cell of ground touches is the ground, to the rounding of a float; at least a share
// of all samples are such.
void expect_ground(const MujocoStub& stub, const Ground& ground, const WorldPos& origin,
                   double range, double least_share = 1.0) {
    int compared = 0;
    for (int row = 0; row < stub.side(); ++row) {
        for (int column = 0; column < stub.side(); ++column) {
            const HeightAnswer want =
                ground.height(origin.x() + stub.x(column), origin.y() + stub.y(row));
            if (want.status != QueryStatus::ok) continue;
            ++compared;
            ASSERT_NEAR(stub.height(column, row), want.height - origin.z(), range * 0x1p-25 + 1e-9)
                << column << ' ' << row;
        }
    }
    EXPECT_GE(compared, least_share * stub.side() * stub.side());
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
    expect_ground(stub, ground, WorldPos::Zero(), 40.0, 0.5);
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

// Every sample of the shape over ground, placed as DART places it, is the ground; at least a share of all are over
// ground.
void expect_ground(const ShapeStub& shape, const Eigen::Vector3d& translation_sim,
                   const Ground& ground, const WorldPos& origin, double least_share = 1.0) {
    int compared = 0;
    const double half_x = 0.5 * static_cast<double>(shape.heights.cols() - 1);
    const double half_y = 0.5 * static_cast<double>(shape.heights.rows() - 1);
    for (Eigen::Index row = 0; row < shape.heights.rows(); ++row) {
        for (Eigen::Index column = 0; column < shape.heights.cols(); ++column) {
            const double x = (static_cast<double>(column) - half_x) * shape.scale.x();
            const double y = (half_y - static_cast<double>(row)) * shape.scale.y();
            const WorldPos p = origin + translation_sim + Eigen::Vector3d(x, y, 0.0);
            const HeightAnswer want = ground.height(p.x(), p.y());
            if (want.status != QueryStatus::ok) continue;
            ++compared;
            ASSERT_NEAR(p.z() + shape.heights(row, column), want.height, 2e-6)
                << row << ' ' << column;
        }
    }
    EXPECT_GE(compared, least_share * static_cast<double>(shape.heights.size()));
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
    expect_ground(shape, update.translation_sim, ground, WorldPos::Zero(), 0.5);
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
