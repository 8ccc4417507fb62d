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
#include <optional>
#include <vector>

namespace terrane::adapters {
namespace mujoco_window_test {

using Status = MujocoWindowStatus;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The members of mjModel and mjData that a MujocoWindow uses, written from the documentation. Body 1 and geom 0 are an
// hfield on a mocap body, body 2 + i and geom 1 + i ball i of at most two.
struct Model {
    int ngeom = 1, nhfield = 1;
    int geom_type[3] = {1, 2, 2};
    int geom_dataid[3] = {0, -1, -1};
    int geom_bodyid[3] = {1, 2, 3};
    int body_mocapid[4] = {-1, 0, -1, -1};
    int body_weldid[4] = {0, 0, 2, 3};
    double geom_pos[9] = {};
    double geom_quat[12] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
    double geom_rbound[3] = {0.5, 0.5, 0.5};
    double hfield_size[4] = {0.0, 0.0, 0.0, 4.0};
    int hfield_nrow[1] = {0}, hfield_ncol[1] = {0}, hfield_adr[1] = {0};
    float* hfield_data = nullptr;
};
struct Data {
    double geom_xpos[9] = {};
    double mocap_pos[3] = {};
    double mocap_quat[4] = {};
};
using Window = MujocoWindow<Model, Data>;

/// A window of `side` samples whose heights range over 40 m.
class Field {
public:
    Field(int side, double spacing, int balls, const MujocoWindowSettings& settings = {})
        : heights_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side)) {
        model.ngeom = 1 + balls;
        model.hfield_size[0] = model.hfield_size[1] = 0.5 * spacing * (side - 1);
        model.hfield_size[2] = kRange;
        model.hfield_nrow[0] = model.hfield_ncol[0] = side;
        model.hfield_data = heights_.data();
        window_.emplace(Window::create(model, 0, settings).value());
    }
    Field(const Field&) = delete;
    Field& operator=(const Field&) = delete;
    ~Field() = default;

    void put_ball(int i, double x, double y, double z) {
        const double place[3] = {x, y, z};
        std::copy_n(place, 3, data.geom_xpos + 3 * (i + 1));
    }
    MujocoWindowUpdate update(const Ground& ground) { return window_->update(model, data, ground); }

    /// Height of the hfield's surface at one of its samples, MuJoCo's frame.
    double height(int column, int row) const {
        const float share = model.hfield_data[row * side() + column];
        return data.mocap_pos[2] + model.hfield_size[2] * static_cast<double>(share);
    }
    double x(int column) const { return data.mocap_pos[0] + from_middle(column); }
    double y(int row) const { return data.mocap_pos[1] + from_middle(row); }
    int side() const { return model.hfield_ncol[0]; }

    // Every sample of the hfield that a cell of ground touches is the ground, to the rounding of a float; at least a
    // share of all samples are such.
    void expect(const Ground& ground, double least_share = 1.0,
                const WorldPos& origin = WorldPos::Zero()) const {
        int compared = 0;
        for (int row = 0; row < side(); ++row) {
            for (int column = 0; column < side(); ++column) {
                const HeightAnswer want =
                    ground.height(origin.x() + x(column), origin.y() + y(row));
                if (want.status != QueryStatus::ok) continue;
                ++compared;
                ASSERT_NEAR(height(column, row), want.height - origin.z(), kRange * 0x1p-25 + 1e-9)
                    << column << ' ' << row;
            }
        }
        EXPECT_GE(compared, least_share * side() * side());
    }

    static constexpr double kRange = 40.0;  // metres
    Model model;
    Data data;

private:
    double from_middle(int i) const {
        return model.hfield_size[0] * (2.0 * i / (side() - 1) - 1.0);
    }

    std::vector<float> heights_;
    std::optional<Window> window_;
};

TEST(MujocoWindow, HoldsTheGroundAroundTheBodiesWhereverTheyGo) {
    const Ground ground = test::make_test_ground(test::rough_height);
    Field field(33, 1.0, 2, {.margin = 4});
    test::Random random(31);
    double x = 64.0, y = 64.0;
    int changes = 0;
    for (int i = 0; i < 200; ++i) {
        x = std::clamp(x + random.between(-3.0, 3.0), 25.0, 103.0);
        y = std::clamp(y + random.between(-3.0, 3.0), 25.0, 103.0);
        field.put_ball(0, x, y, 30.0);
        field.put_ball(1, x + 5.0, y - 5.0, 30.0);
        const MujocoWindowUpdate update = field.update(ground);
        ASSERT_EQ(update.status, Status::ok);
        EXPECT_TRUE(update.covers_boxes);
        EXPECT_EQ(update.unsupported_boxes, 0);
        changes += update.has_changed ? 1 : 0;
        field.expect(ground);
    }
    EXPECT_GT(changes, 5);
    EXPECT_LT(changes, 100);  // far from one for each step
}

TEST(MujocoWindow, NormalisesHeightsFromTheLowestGroundOfTheWindow) {
    const Ground ground = test::make_test_ground(test::plane_height);
    Field field(17, 1.0, 1, {.margin = 2});
    field.put_ball(0, 64.0, 64.0, 30.0);
    const MujocoWindowUpdate update = field.update(ground);
    EXPECT_EQ(update.height_range, 16 * 0.25 + 16 * 0.125);
    // the plane rises to the east and falls to the north
    EXPECT_EQ(field.data.mocap_pos[2], field.height(0, 16));
    EXPECT_EQ(field.height(0, 16), test::plane_height(field.x(0), field.y(16)));
    EXPECT_EQ(update.surface_error_m, 40.0 * 0x1p-25);  // a plane has no twist
    for (int i = 0; i < 17 * 17; ++i) {
        EXPECT_GE(field.model.hfield_data[i], 0.0f);
        EXPECT_LE(field.model.hfield_data[i], 1.0f);
    }
}

TEST(MujocoWindow, BoundsTheDifferenceOfTheTwoWaysToCutACell) {
    const Ground ground = test::make_test_ground(test::rough_height);
    Field field(33, 1.0, 1);
    field.put_ball(0, 64.0, 64.0, 30.0);
    const double bound = field.update(ground).surface_error_m;
    double largest = 0.0;
    test::Random random(37);
    for (int i = 0; i < 20'000; ++i) {
        const double u = random.between(0.0, 32.0), v = random.between(0.0, 32.0);
        const int column = static_cast<int>(u), row = static_cast<int>(v);
        const double fx = u - column, fy = v - row;
        const double sw = field.height(column, row), ne = field.height(column + 1, row + 1);
        const double se = field.height(column + 1, row), nw = field.height(column, row + 1);
        // MuJoCo's triangles: south-west, north-east, and one of the other corners
        const double z =
            fx >= fy ? sw + fx * (se - sw) + fy * (ne - se) : sw + fy * (nw - sw) + fx * (ne - nw);
        const double x = field.x(0) + u, y = field.y(0) + v;
        largest = std::max(largest, std::abs(z - ground.height(x, y).height));
    }
    EXPECT_LE(largest, bound * (1 + 1e-9));
    EXPECT_GT(largest, 0.5 * bound);  // the bound is one of the cells that are there
}

TEST(MujocoWindow, PutsAbsentGroundAtTheBottomAndCountsTheBodiesOverIt) {
    const Ground ground = test::make_broken_ground();  // x < 8 outside, the north-east not resident
    Field field(33, 1.0, 2, {.margin = 4});
    field.put_ball(0, 20.0, 40.0, 30.0);
    field.put_ball(1, 12.0, 40.0, 30.0);
    EXPECT_EQ(field.update(ground).unsupported_boxes, 0);
    field.put_ball(1, 8.3, 40.0, 30.0);  // its box reaches over the edge
    const MujocoWindowUpdate edge = field.update(ground);
    EXPECT_EQ(edge.unsupported_boxes, 1);
    EXPECT_GT(edge.absent_cells, 0);
    field.expect(ground, 0.5);
    ASSERT_LT(field.x(0), 7.0);
    for (int row = 0; row < 33; ++row) EXPECT_EQ(field.model.hfield_data[33 * row], 0.0f);
    field.put_ball(0, 128.0, 128.0, 30.0);
    field.put_ball(1, 120.0, 120.0, 30.0);
    EXPECT_EQ(field.update(ground).unsupported_boxes, 1);
}

TEST(MujocoWindow, SaysThatThereIsNoGroundAtAll) {
    Field field(33, 1.0, 1);
    const Ground broken = test::make_broken_ground();
    field.put_ball(0, 200.0, 200.0, 0.0);
    const MujocoWindowUpdate absent = field.update(broken);
    EXPECT_EQ(absent.status, Status::no_ground);
    EXPECT_EQ(absent.unsupported_boxes, 1);
    // the window stays within the extent
    field.put_ball(0, -1e9, 1e9, 0.0);
    EXPECT_EQ(field.update(broken).unsupported_boxes, 1);
    field.put_ball(0, 200.0, 200.0, 0.0);
    const Ground arrived = test::make_test_ground(test::plane_height, 1.0, 2);
    EXPECT_EQ(field.update(arrived).status, Status::ok);
    field.expect(arrived);
}

TEST(MujocoWindow, LeavesTheFieldAloneWhereItsRangeIsTooSmall) {
    const Ground ground =
        test::make_test_ground([](double x, double) { return x < 80 ? 0.0 : 50.0; });
    Field field(17, 1.0, 1, {.margin = 2});
    field.put_ball(0, 60.0, 60.0, 1.0);
    ASSERT_EQ(field.update(ground).status, Status::ok);
    const double x = field.data.mocap_pos[0];
    field.put_ball(0, 80.0, 60.0, 1.0);
    const MujocoWindowUpdate cliff = field.update(ground);
    EXPECT_EQ(cliff.status, Status::too_high);
    EXPECT_FALSE(cliff.has_changed);
    EXPECT_EQ(cliff.height_range, 50.0);
    EXPECT_EQ(cliff.unsupported_boxes, 1);
    EXPECT_EQ(field.data.mocap_pos[0], x);
    field.put_ball(0, 110.0, 60.0, 51.0);
    EXPECT_EQ(field.update(ground).status, Status::ok);
    field.expect(ground);
}

TEST(MujocoWindow, RefusesGroundOfAnotherSpacingAndBodiesThatAreNowhere) {
    Field field(17, 0.5, 1, {.margin = 2});
    const Ground ground = test::make_test_ground(test::plane_height);
    EXPECT_EQ(field.update(ground).status, Status::wrong_spacing);
    const Ground fine = test::make_test_ground(test::plane_height, 0.5, 1);
    field.put_ball(0, kNan, 10.0, 0.0);
    const MujocoWindowUpdate nowhere = field.update(fine);
    EXPECT_EQ(nowhere.status, Status::no_bodies);
    EXPECT_EQ(nowhere.unsupported_boxes, 1);
    EXPECT_FALSE(nowhere.has_changed);
    Field empty(17, 1.0, 0, {.margin = 2});
    EXPECT_EQ(empty.update(ground).status, Status::no_bodies);
}

TEST(MujocoWindow, KeepsItsPrecisionAMillionKilometresOut) {
    const Ground ground = test::make_far_ground();
    const WorldPos origin(1e9, -1e9, 1e5);
    Field field(33, 1.0, 1, {.origin_world = origin});
    field.put_ball(0, 64.0, 60.0, 20.0);
    ASSERT_EQ(field.update(ground).status, Status::ok);
    field.expect(ground, 1.0, origin);
    EXPECT_NEAR(field.height(16, 16), test::plane_height(field.x(16), field.y(16)), 1e-3);
}

TEST(MujocoWindow, CountsBodiesOverVolumes) {
    Field field(33, 1.0, 1);
    const auto make_pit = [](const Chunk&) {
        SolidTriangles pit;  // of which only the hole in the heightfield matters here
        pit.replaced = {static_cast<std::uint16_t>(2 * cell_index(50, 50)),
                        static_cast<std::uint16_t>(2 * cell_index(50, 50) + 1)};
        return std::make_shared<const SolidSurface>(std::move(pit));
    };
    const Ground ground =
        test::make_test_ground([](double, double) { return 20.0; }, {.solid = make_pit});
    field.put_ball(0, 50.5, 50.5, 21.0);
    EXPECT_EQ(field.update(ground).boxes_over_volumes, 1);
    field.put_ball(0, 53.5, 50.5, 21.0);
    EXPECT_EQ(field.update(ground).boxes_over_volumes, 0);
}

TEST(MujocoWindow, RefusesGeomsThatCannotMove) {
    Field field(17, 1.0, 1, {.margin = 2});
    const auto is_refused = [&](int geom, const MujocoWindowSettings& settings = {.margin = 2}) {
        return !Window::create(field.model, geom, settings);
    };
    EXPECT_FALSE(is_refused(0));
    for (const int geom : {-1, 1, 2}) EXPECT_TRUE(is_refused(geom));  // 1: a ball
    EXPECT_TRUE(is_refused(0, {.origin_world = {kNan, 0, 0}, .margin = 2}));
    EXPECT_TRUE(is_refused(0, {.margin = -1}));
    EXPECT_TRUE(is_refused(0, {.margin = 8}));  // half of the window
    for (double* const moved : {field.model.geom_pos + 2, field.model.geom_quat + 3}) {
        *moved = 1.0;
        EXPECT_TRUE(is_refused(0));
        *moved = 0.0;
    }
    field.model.body_mocapid[1] = -1;
    const Result<Window> fixed = Window::create(field.model, 0, {.margin = 2});
    ASSERT_FALSE(fixed);
    EXPECT_EQ(fixed.error().message, "the hfield geom 0 must be on a mocap body");
    field.model.body_mocapid[1] = 0;
    for (const int side : {0, 1, 1'000'000'000}) {
        field.model.hfield_ncol[0] = side;
        EXPECT_TRUE(is_refused(0)) << side;
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
                   const Ground& ground, double least_share = 1.0) {
    int compared = 0;
    const double half_x = 0.5 * static_cast<double>(shape.heights.cols() - 1);
    const double half_y = 0.5 * static_cast<double>(shape.heights.rows() - 1);
    for (Eigen::Index row = 0; row < shape.heights.rows(); ++row) {
        for (Eigen::Index column = 0; column < shape.heights.cols(); ++column) {
            const double x = (static_cast<double>(column) - half_x) * shape.scale.x();
            const double y = (half_y - static_cast<double>(row)) * shape.scale.y();
            const WorldPos p = translation_sim + Eigen::Vector3d(x, y, 0.0);
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
        expect_ground(shape, update.translation_sim, ground);
        EXPECT_FALSE(window.update(shape, ground, boxes).has_changed) << "nothing is new";
    }
    EXPECT_GT(shape.version, 3);
    EXPECT_LT(shape.version, 75);  // far from one for each step
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
    expect_ground(shape, update.translation_sim, ground, 0.5);
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

TEST(DartWindow, RefusesWindowsOfNoCellsAndOfABillion) {
    EXPECT_FALSE(Window::create({.columns = 0}));
    EXPECT_FALSE(Window::create({.rows = -1}));
    EXPECT_FALSE(Window::create({.columns = 1'000'000'000, .rows = 1'000'000'000}));
    EXPECT_FALSE(Window::create({.columns = 16, .rows = 16, .margin = 8}));
    EXPECT_FALSE(Window::create({.origin_world = {0, 0, kNan}}));
}

}  // namespace dart_window_test
}  // namespace terrane::adapters
