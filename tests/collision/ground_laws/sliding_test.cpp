// SPDX-License-Identifier: MIT
//
// Bodies that slide without friction over seams of a plane get no velocity out of the plane.
#include "law_cases.h"
#include "references/reference_maps.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/pager.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::sliding_test {

using namespace test;

struct DyadicPlane {
    double slope_x, slope_y;
    double height(double x, double y) const { return slope_x * x + slope_y * y; }
    Eigen::Vector3d normal() const { return Eigen::Vector3d(-slope_x, -slope_y, 1.0).normalized(); }
};

constexpr std::array<DyadicPlane, 4> kPlanes{
    DyadicPlane{0.0, 0.0}, {0.25, 0.0}, {0.25, -0.5}, {-1.0, 0.125}};

// A paged world of one root square with two further levels: the chunks that meet at 128 m have the same parent, those
// at 256 m only the root in common.
template <class Height>
Ground make_paged_ground(const Height& height) {
    HeightTable table;
    table.columns = table.rows = 513;
    for (int y = 0; y < table.rows; ++y) {
        for (int x = 0; x < table.columns; ++x) {
            table.heights.push_back(static_cast<float>(height(x, y)));
        }
    }
    const auto source = std::make_shared<const TableHeights>(std::move(table));
    Pager pager = *Pager::create(source, PagerSettings{.worker_count = 0});
    RequiredRegion required = pager.require(source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    EXPECT_TRUE(required.is_ready());
    return pager.ground();
}

// A pose in which a shape touches a plane, with an axis along a direction in the plane. For a capsule that is its own
// axis, the worst case.
Pose pose_on_plane(const Soup& soup, const LawShape& shape, const Eigen::Vector2d& at,
                   const Eigen::Vector3d& normal, const Eigen::Vector3d& along) {
    Pose pose{.translation = {at.x(), at.y(), 0.0}};
    const Eigen::Vector3d side = normal.cross(along);
    if (std::holds_alternative<Capsule>(shape.shape)) {
        pose.rotation << side, normal, along;
    } else {
        pose.rotation << along, side, normal;
    }
    for (int round = 0; round < 3; ++round) {
        pose.translation.z() +=
            static_cast<double>(brute_lift<long double>(soup, shape.oracle, pose));
    }
    return pose;
}

// Slides from 10 m before a seam to 10 m beyond it along x, y or both, with and without gravity towards the plane.
void expect_no_kick(const DyadicPlane& plane, const Ground& ground, double seam,
                    const LawShape& shape) {
    const Eigen::Vector3d n = plane.normal();
    const Soup soup(ground);
    for (const Eigen::Vector3d& heading :
         {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 1.0, 0.0),
          Eigen::Vector3d(1.0, 1.0, 0.0), Eigen::Vector3d(1.0, -0.3, 0.0)}) {
        for (const double pressed : {0.0, 9.81}) {
            const Eigen::Vector3d along = (heading - heading.dot(n) * n).normalized();
            WorldSettings settings{.gravity = -pressed * n, .allow_sleep = false};
            World world = *World::create(settings);
            BodySettings body{.shape = shape.shape};
            body.friction = body.restitution = 0.0;
            BodyState state;
            const Eigen::Vector2d to = along.head<2>() * (10.0 / along.head<2>().norm());
            state.pose = pose_on_plane(soup, shape, Eigen::Vector2d::Constant(seam) - to, n, along);
            state.velocity = 20.0 * along;
            const BodyId id = world.add(body, state).value();
            double worst = 0.0;
            for (int step = 0; step < 60; ++step) {
                world.step(ground, 1.0 / 60.0);
                // With gravity it first settles within the tolerance, before any seam.
                if (step < 6) continue;
                worst = std::max(worst, std::abs(world.state(id).velocity.dot(n)));
            }
            const Eigen::Vector3d velocity = world.state(id).velocity;
            EXPECT_LT(worst, 1e-6)
                << shape.name << " over " << seam << " heading " << heading.transpose()
                << ", pressed " << pressed << ", slopes " << plane.slope_x << " " << plane.slope_y;
            EXPECT_NEAR(velocity.dot(along), 20.0, 1e-6);
            EXPECT_LT(world.state(id).angular_velocity.norm(), 1e-6);
        }
    }
}

TEST(LawsOfSliding, SeamsOfRootSquaresAndChunksGiveNoImpulseWhateverTheirParents) {
    for (const DyadicPlane& plane : kPlanes) {
        const auto height = [&](double x, double y) { return plane.height(x, y); };
        const Ground roots = make_test_ground(height, 1.0, 2);
        const Ground chunks = make_paged_ground(height);
        for (const char* name : {"box", "capsule", "sphere"}) {
            expect_no_kick(plane, roots, 128.0, shape_named(name));
            expect_no_kick(plane, chunks, 128.0, shape_named(name));
            expect_no_kick(plane, chunks, 256.0, shape_named(name));
        }
    }
}

TEST(LawsOfSliding, ABoxOverFlatCellsForTwoSecondsKeepsItsVelocity) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    World world = *World::create({});
    BodySettings body{.shape = Box{{0.5, 0.5, 0.5}}};
    body.friction = body.restitution = 0.0;
    BodyState state{{.pose = {.translation = {40.3, 50.2, 0.5}}, .velocity = {3.0, 0.0, 0.0}}};
    const BodyId id = world.add(body, state).value();
    for (int step = 0; step < 120; ++step) world.step(ground, 1.0 / 60.0);
    EXPECT_LT((world.state(id).velocity - state.velocity).norm(), 2e-3);
    EXPECT_NEAR(world.state(id).pose.translation.x(), 46.3, 4e-3);
    EXPECT_LT(world.state(id).angular_velocity.norm(), 2e-3);
}

// Principal moments of inertia of a solid of 1 kg, kg m^2.
Eigen::Vector3d solid_inertia(const Shape& shape) {
    if (const auto* box = std::get_if<Box>(&shape)) {
        const Eigen::Vector3d square = box->half_extents.cwiseAbs2() / 3.0;
        return {square.y() + square.z(), square.x() + square.z(), square.x() + square.y()};
    }
    if (const auto* sphere = std::get_if<Sphere>(&shape)) {
        return Eigen::Vector3d::Constant(0.4 * sphere->radius * sphere->radius);
    }
    // A cylinder and two hemispheres, whose centres of mass are 3/8 of the radius beyond its ends.
    const auto& capsule = std::get<Capsule>(shape);
    const double r = capsule.radius, h = capsule.half_height;
    const double ends = (4.0 / 3.0 * r) / (4.0 / 3.0 * r + 2.0 * h), middle = 1.0 - ends;
    const double across =
        middle * (r * r / 4.0 + h * h / 3.0) + ends * (0.4 * r * r + h * h + 0.75 * h * r);
    return {across, across, middle * r * r / 2.0 + ends * 0.4 * r * r};
}

/// A body that slides from rest without friction.
class Downhill {
public:
    // @param along downhill at the start: horizontal, unit
    Downhill(Ground ground, const LawShape& shape, const Eigen::Vector2d& start,
             const Eigen::Vector3d& normal, const Eigen::Vector2d& along)
        : ground_(std::move(ground)), inertia_(solid_inertia(shape.shape)) {
        BodySettings settings{.shape = shape.shape};
        settings.friction = settings.restitution = 0.0;
        const Eigen::Vector3d level(along.x(), along.y(), 0.0);
        const Eigen::Vector3d down = (level - level.dot(normal) * normal).normalized();
        BodyState state;
        state.pose = pose_on_plane(Soup(ground_), shape, start, normal, down);
        world_.emplace(*World::create(WorldSettings{.allow_sleep = false}));
        id_ = world_->add(settings, state).value();
        energy_ = energy();
    }

    void step() {
        world_->step(ground_, kStep);
        const double now = energy();
        growth_ = std::max(growth_, now - energy_);
        energy_ = now;
    }
    const BodyState& body() const { return world_->state(id_); }
    /// Largest energy gain of 1 kg in a step, joules.
    double growth() const { return growth_; }

    static constexpr double kStep = 1.0 / 60.0;

private:
    // Kinetic and potential energy of 1 kg, joules.
    double energy() const {
        const Eigen::Vector3d spin = body().pose.rotation.transpose() * body().angular_velocity;
        return 0.5 * (body().velocity.squaredNorm() + spin.dot(inertia_.cwiseProduct(spin))) +
               9.81 * body().pose.translation.z();
    }

    Ground ground_;
    std::optional<World> world_;
    BodyId id_;
    Eigen::Vector3d inertia_;
    double energy_ = 0.0, growth_ = 0.0;
};

TEST(LawsOfSliding, DownAPlaneTheDistanceIsThatOfTheInclinedPlane) {
    for (const DyadicPlane& plane : kPlanes) {
        if (plane.slope_x == 0.0 && plane.slope_y == 0.0) continue;
        const Ground ground =
            make_paged_ground([&](double x, double y) { return plane.height(x, y); });
        const Eigen::Vector2d slope(plane.slope_x, plane.slope_y);
        const Eigen::Vector2d along = -slope.normalized();
        const Eigen::Vector2d start = Eigen::Vector2d::Constant(256.0) - 190.0 * along;
        const double pull = 9.81 * slope.norm() / std::hypot(1.0, slope.norm());
        for (const char* name : {"box", "capsule", "sphere"}) {
            SCOPED_TRACE(testing::Message() << name << ", slopes " << slope.transpose());
            Downhill downhill(ground, shape_named(name), start, plane.normal(), along);
            const WorldPos from = downhill.body().pose.translation;
            double time = 0.0;
            while ((downhill.body().pose.translation - from).norm() < 380.0 && time < 60.0) {
                downhill.step();
                time += Downhill::kStep;
            }
            const double distance = (downhill.body().pose.translation - from).norm();
            EXPECT_NEAR(distance, 0.5 * pull * time * time, 1e-3 * distance) << time << " s";
            EXPECT_LE(downhill.growth(), 0.0);
        }
    }
}

TEST(LawsOfSliding, ThroughAValleyThePositionIsThatOfABeadOnTheCurve) {
    constexpr double kRadius = 5000.0, kMiddle = 256.0;
    const auto height = [](double x, double) {
        return (x - kMiddle) * (x - kMiddle) / (2.0 * kRadius);
    };
    const Ground ground = make_paged_ground(height);
    for (const char* name : {"box", "capsule", "sphere"}) {
        SCOPED_TRACE(name);
        const double start = kMiddle - 200.0;
        const double slope = (start - kMiddle) / kRadius;
        Downhill downhill(ground, shape_named(name), {start, 100.3},
                          Eigen::Vector3d(-slope, 0.0, 1.0).normalized(), {1.0, 0.0});
        // reference: a bead on that curve, by the midpoint rule
        double x = downhill.body().pose.translation.x() - kMiddle, v = 0.0;
        const double from = x;
        const auto pull = [](double at, double speed) {
            const double rise = at / kRadius;
            return -rise * (9.81 + speed * speed / kRadius) / (1.0 + rise * rise);
        };
        for (int step = 0; step < 60 * 60; ++step) {
            downhill.step();
            constexpr int kParts = 20;
            for (int part = 0; part < kParts; ++part) {
                const double h = Downhill::kStep / kParts;
                const double x_half = x + 0.5 * h * v, v_half = v + 0.5 * h * pull(x, v);
                x += h * v_half;
                v += h * pull(x_half, v_half);
            }
            const double expected = x - from;
            const double slid = downhill.body().pose.translation.x() - kMiddle - from;
            if (step % 600 == 599) {
                EXPECT_NEAR(slid, expected, 1e-3 * expected) << (step + 1) / 60 << " s";
            }
        }
        EXPECT_LE(downhill.growth(), 0.0);
    }
}

// Casts and contacts without a solver: a motion along the plane hits nothing, and all contacts have the plane's normal.
TEST(LawsOfSliding, CastsAlongATouchedPlaneHitNoSeam) {
    CastSettings settings{.skip_separating = true};
    for (const DyadicPlane& plane : kPlanes) {
        const Ground ground =
            make_test_ground([&](double x, double y) { return plane.height(x, y); }, 1.0, 2);
        const Soup soup(ground);
        for (const LawShape& shape : law_shapes()) {
            Random random(20260310);
            for (int i = 0; i < 40; ++i) {
                Motion motion{.start = {random.rotation(),
                                        {118.0 + random.between(0.0, 5.0),
                                         118.0 + random.between(0.0, 5.0), 0.0}}};
                motion.start.translation.z() = 1e-5 + static_cast<double>(brute_lift<long double>(
                                                          soup, shape.oracle, motion.start));
                motion.translation = {16.0, 16.0, 16.0 * (plane.slope_x + plane.slope_y)};
                SCOPED_TRACE(testing::Message()
                             << shape.name << ", slopes " << plane.slope_x << " " << plane.slope_y);
                EXPECT_FALSE(cast(shape.shape, motion, ground, settings).hit);
                Motion beyond_tolerance = motion;
                beyond_tolerance.start.translation += 1.01e-4 * plane.normal();
                EXPECT_FALSE(cast(shape.shape, beyond_tolerance, ground).hit);
                std::array<Contact, 64> contacts;
                const ContactAnswer found =
                    find_contacts(shape.shape, motion.at(0.6), ground, 1e-3, contacts);
                ASSERT_GT(found.count, 0u);
                for (std::size_t k = 0; k < found.count; ++k) {
                    EXPECT_LT((contacts[k].normal - plane.normal()).norm(), 1e-12);
                }
            }
        }
    }
}

}  // namespace terrane::sliding_test

// Shapes below the ground are separated by alternately finding contacts and resolving all of them.

namespace terrane::freed_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260305;
constexpr int kRounds = 8;

TEST(SeparatedFromBelow, WithinEightRoundsFromAnyDepth) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(11, 20'000);
    std::array<Contact, 256> contacts;
    std::printf("rounds:%28s", "");
    for (int round = 0; round <= kRounds; ++round) std::printf("%7d", round);
    std::printf("   not separated\n");
    for (const LawShape& shape : law_shapes()) {
        for (const double below : {0.1, 0.3, 1.0, 3.0, 100.0}) {
            std::array<long, kRounds + 2> rounds{};
            for (long i = 0; i < count; ++i) {
                const LawScene& scene = scene_of(i);
                const Pose start = random_pose(random, scene, shape, 0.0);
                Pose pose = start;
                pose.translation.z() =
                    scene.soup.height(pose.translation.x(), pose.translation.y()) - below;
                const Pose below_ground = pose;
                int round = 0;
                for (; round <= kRounds; ++round) {
                    const ContactAnswer answer =
                        find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
                    if (!is_deeper<long double>(scene.soup, shape.oracle, pose,
                                                Vec<long double>::Zero(), 1e-8L)) {
                        break;
                    }
                    const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
                    pose = moved(pose, d);
                }
                ++rounds[static_cast<std::size_t>(round)];
                EXPECT_LE(round, kRounds) << describe(scene, shape, below_ground);
            }
            std::printf("%-8s %5.1f m below, %6ld:  ", shape.name.c_str(), below, count);
            for (const long many : rounds) std::printf("%7ld", many);
            std::printf("\n");
        }
    }
}

}  // namespace terrane::freed_test
