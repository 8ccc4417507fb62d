// SPDX-License-Identifier: MIT
// Bodies that slide without friction over seams of a plane keep to the plane.
#include "collision/ground_laws/law_cases.h"
#include "support/reference_maps.h"

#include <terrane/collision/bodies.h>
#include <terrane/collision/ground_cast.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <memory>

namespace terrane {
namespace {

using namespace test;

struct DyadicPlane {
    double slope_x, slope_y;
    double height(double x, double y) const { return slope_x * x + slope_y * y; }
    Eigen::Vector3d normal() const { return Eigen::Vector3d(-slope_x, -slope_y, 1.0).normalized(); }
};

constexpr std::array<DyadicPlane, 4> kPlanes{
    DyadicPlane{0.0, 0.0}, {0.25, 0.0}, {0.25, -0.5}, {-1.0, 0.125}};

// A paged world of one root square with two levels of chunks below it: at 128 m the parents of two
// neighbours are the same, at 256 m they meet only in the root.
Ground make_paged_plane(const DyadicPlane& plane) {
    HeightTable table;
    table.columns = table.rows = 513;
    for (int y = 0; y < table.rows; ++y) {
        for (int x = 0; x < table.columns; ++x) {
            table.heights.push_back(static_cast<float>(plane.height(x, y)));
        }
    }
    const auto source = std::make_shared<const TableHeights>(std::move(table));
    PagerSettings settings;
    settings.worker_count = 0;
    Pager pager = *Pager::create(source, settings);
    const Pager::Ticket ticket = pager.require(source->extent(), 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    EXPECT_TRUE(pager.is_ready(ticket));
    return Ground(pager.resident(), pager.contact_level());
}

// From 10 m before a seam to 10 m behind it, along x, y or both, pressed on or not.
void expect_no_kick(const DyadicPlane& plane, const Ground& ground, double seam,
                    const LawShape& shape) {
    const Eigen::Vector3d n = plane.normal();
    const Soup soup(ground);
    for (const Eigen::Vector3d& heading :
         {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 1.0, 0.0),
          Eigen::Vector3d(1.0, 1.0, 0.0), Eigen::Vector3d(1.0, -0.3, 0.0)}) {
        for (const double pressed : {0.0, 9.81}) {
            const Eigen::Vector3d along = (heading - heading.dot(n) * n).normalized();
            BodyWorldSettings settings;
            settings.gravity = -pressed * n;
            settings.allow_sleep = false;
            BodyWorld world = *BodyWorld::create(settings);
            BodySettings body;
            body.shape = shape.shape;
            body.friction = body.restitution = 0.0;
            BodyState state;
            // lying on the plane; a capsule along the way, as it is worst
            const Eigen::Vector3d side = n.cross(along);
            if (std::holds_alternative<Capsule>(shape.shape)) {
                state.pose.rotation << side, n, along;
            } else {
                state.pose.rotation << along, side, n;
            }
            const Eigen::Vector3d to = along * (10.0 / along.head<2>().norm());
            state.pose.translation = {seam - to.x(), seam - to.y(), 0.0};
            for (int round = 0; round < 3; ++round) {
                state.pose.translation.z() +=
                    static_cast<double>(brute_lift<long double>(soup, shape.oracle, state.pose));
            }
            state.velocity = 20.0 * along;
            ASSERT_TRUE(world.add(body, state));
            double worst = 0.0;
            for (int step = 0; step < 60; ++step) {
                world.step(ground, 1.0 / 60.0);
                // What is pressed on falls into its resting slop first: g dt, and before any seam.
                if (step < 6) continue;
                worst = std::max(worst, std::abs(world.states()[0].velocity.dot(n)));
            }
            const Eigen::Vector3d velocity = world.states()[0].velocity;
            EXPECT_LT(worst, 1e-6)
                << shape.name << " over " << seam << " heading " << heading.transpose()
                << ", pressed " << pressed << ", slopes " << plane.slope_x << " " << plane.slope_y;
            EXPECT_NEAR(velocity.dot(along), 20.0, 1e-6);
            EXPECT_LT(world.states()[0].angular_velocity.norm(), 1e-6);
        }
    }
}

TEST(LawsOfSliding, NothingIsKickedOverSeamsOfRootSquares) {
    for (const DyadicPlane& plane : kPlanes) {
        const Ground ground =
            make_test_ground([&](double x, double y) { return plane.height(x, y); }, 1.0, 2);
        for (const char* name : {"box", "capsule", "sphere"}) {
            expect_no_kick(plane, ground, 128.0, shape_named(name));
        }
    }
}

TEST(LawsOfSliding, NothingIsKickedOverSeamsOfChunksWhateverTheirParents) {
    for (const DyadicPlane& plane : kPlanes) {
        const Ground ground = make_paged_plane(plane);
        for (const double seam : {128.0, 256.0}) {
            for (const char* name : {"box", "capsule", "sphere"}) {
                expect_no_kick(plane, ground, seam, shape_named(name));
            }
        }
    }
}

TEST(LawsOfSliding, ABoxOverFlatCellsForTwoSecondsKeepsItsVelocity) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    BodyWorld world = *BodyWorld::create({});
    BodySettings body;
    body.shape = Box{{0.5, 0.5, 0.5}};
    body.friction = body.restitution = 0.0;
    BodyState state;
    state.pose.translation = {40.3, 50.2, 0.5};
    state.velocity = {3.0, 0.0, 0.0};
    ASSERT_TRUE(world.add(body, state));
    for (int step = 0; step < 120; ++step) world.step(ground, 1.0 / 60.0);
    EXPECT_LT((world.states()[0].velocity - state.velocity).norm(), 2e-3);
    EXPECT_NEAR(world.states()[0].pose.translation.x(), 46.3, 4e-3);
    EXPECT_LT(world.states()[0].angular_velocity.norm(), 2e-3);
}

// Cast and find alone, without a solver: the way along the plane is never a hit, and contacts push along
// the plane's normal only.
TEST(LawsOfSliding, CastsAlongAPlaneInTouchPassAllSeams) {
    CastSettings settings;
    settings.skip_separating = true;
    for (const DyadicPlane& plane : kPlanes) {
        const Ground ground =
            make_test_ground([&](double x, double y) { return plane.height(x, y); }, 1.0, 2);
        const Soup soup(ground);
        for (const LawShape& shape : law_shapes()) {
            Random random(20260310);
            for (int i = 0; i < 40; ++i) {
                Motion motion;
                motion.start.rotation = random.rotation();
                motion.start.translation = {118.0 + random.between(0.0, 5.0),
                                            118.0 + random.between(0.0, 5.0), 0.0};
                motion.start.translation.z() = 1e-5 + static_cast<double>(brute_lift<long double>(
                                                          soup, shape.oracle, motion.start));
                motion.translation = {16.0, 16.0, 16.0 * (plane.slope_x + plane.slope_y)};
                EXPECT_FALSE(cast(shape.shape, motion, ground, settings).hit)
                    << shape.name << ", slopes " << plane.slope_x << " " << plane.slope_y;
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

}  // namespace
}  // namespace terrane
