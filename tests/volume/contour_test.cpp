// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "volume/analytic_solid.h"
#include "volume/flat_world.h"
#include "volume/joined_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace contour_test {

using namespace test;

constexpr double kPi = 3.14159265358979323846;

struct Joined {
    Volumes volumes;
    std::vector<VolumeContour> contours;
    JoinedMesh mesh;
    Joined(const VolumeWorld& world, const std::vector<VolumeOperation>& operations)
        : volumes(Volumes::create(world.lattice, operations).value()),
          contours(contour_all(world, volumes)),
          mesh(join(world, volumes, contours)) {}
    std::size_t count(SolidPart surface) const {
        std::size_t count = 0;
        for (const VolumeContour& contour : contours) {
            count += static_cast<std::size_t>(std::ranges::count(contour.surfaces, surface));
        }
        return count;
    }
    std::size_t replaced() const {
        std::size_t count = 0;
        for (const VolumeContour& contour : contours) count += contour.replaced.size();
        return count;
    }
};

TEST(Contour, EnclosesTheVolumeOfSpheresBelowAboveAndInTheGround) {
    const VolumeWorld world = flat_world();
    const double ground = 40.0 * 128.0 * 128.0, ball = 4.0 / 3.0 * kPi * std::pow(12.0, 3);
    for (const double z : {20.0, 40.0, 60.0}) {
        for (const VolumeOp op : {VolumeOp::remove, VolumeOp::add}) {
            const Joined joined(world, {place(op, VolumeSphere{12.0}, {63.7, 64.2, z})});
            EXPECT_EQ(find_leak(world, joined.mesh), "");
            // The part of the ball where the operation changes something.
            const bool below = z<30.0, above = z> 50.0, removes = op == VolumeOp::remove;
            const double share = below   ? (removes ? 1.0 : 0.0)
                                 : above ? (removes ? 0.0 : 1.0)
                                         : 0.5;
            EXPECT_NEAR(signed_volume(joined.mesh) - ground, (removes ? -1.0 : 1.0) * share * ball,
                        0.01 * ball);
            EXPECT_EQ(joined.count(SolidPart::cavity) > 0, removes && !above);
            EXPECT_EQ(joined.count(SolidPart::overhang) > 0, !removes && !below);
            EXPECT_EQ(joined.replaced() > 0, !below && !above);
        }
    }
}

TEST(Contour, IsClosedForAllStatesOfATrianglesSamples) {
    // A small sphere at every sample of a part of the ground: void, solid or none.
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Random random(seed);
        const VolumeWorld world =
            VolumeWorld::make(1, 1.0, [&](int, int) { return 40.0 + random.between(0.0, 1.5); });
        std::vector<VolumeOperation> operations;
        for (int row = 24; row < 40; ++row) {
            for (int column = 24; column < 40; ++column) {
                const int state = random.below(3);
                if (state == 0) continue;
                operations.push_back(
                    place(state == 1 ? VolumeOp::remove : VolumeOp::add, VolumeSphere{0.55},
                          {double(column), double(row), world.sample(column, row)}));
            }
        }
        const Joined joined(world, operations);
        EXPECT_EQ(find_leak(world, joined.mesh), "") << "seed " << seed;
        EXPECT_GT(joined.count(SolidPart::ground), 100u);
        EXPECT_GT(joined.count(SolidPart::overhang), 100u);
    }
}

TEST(Contour, IsClosedWhereFacesPassThroughNodes) {
    const VolumeWorld world = flat_world();
    for (const double z : {30.0, 35.0, 40.0, 45.0}) {
        for (const VolumeOp op : {VolumeOp::remove, VolumeOp::add}) {
            const Joined joined(
                world, {place(op, VolumeBox{{4.0, 6.0, 5.0}}, {64.0, 64.0, z}),
                        place(VolumeOp::remove, VolumeBox{{4.0, 6.0, 5.0}}, {72.0, 64.0, z}),
                        place(VolumeOp::add, VolumeBox{{4.0, 6.0, 5.0}}, {68.0, 76.0, z})});
            EXPECT_EQ(find_leak(world, joined.mesh), "");
        }
    }
}

TEST(Contour, IsOpenOnlyAtTheWorldsBorder) {
    const VolumeWorld world = flat_world();
    const Joined joined(world, {place(VolumeOp::remove, VolumeSphere{9.0}, {0.0, 0.0, 38.0}),
                                place(VolumeOp::add, VolumeTube{{{0, 0, 0}, {90, 0, 0}}, 6.0},
                                      {60.0, 90.0, 42.0})});
    EXPECT_EQ(find_leak(world, joined.mesh), "");
    EXPECT_GT(joined.replaced(), 0u);
}

TEST(Contour, LeavesAloneWhatItDoesNotReach) {
    const VolumeWorld world = flat_world();
    const Joined joined(world, {place(VolumeOp::remove, VolumeSphere{5.0}, {64.0, 64.0, 80.0}),
                                place(VolumeOp::add, VolumeSphere{5.0}, {64.0, 64.0, 10.0})});
    for (const VolumeContour& contour : joined.contours) {
        EXPECT_TRUE(contour.triangles.empty() && contour.keys.empty() && contour.replaced.empty());
    }
    EXPECT_TRUE(Volumes::create(world.lattice, std::vector{place(VolumeOp::remove,
                                                                 VolumeSphere{5.0}, {20, 20, 0})})
                    ->operations_at({3, 3})
                    .empty());
}

TEST(Contour, LaterOperationsPrevail) {
    const VolumeWorld world = flat_world();
    const auto cave = place(VolumeOp::remove, VolumeSphere{12.0}, {64.0, 64.0, 20.0});
    const auto fill = place(VolumeOp::add, VolumeSphere{15.0}, {64.0, 64.0, 20.0});
    EXPECT_EQ(Joined(world, {cave, fill}).mesh.triangles.size(), 2u * 128u * 128u);
    EXPECT_GT(Joined(world, {fill, cave}).mesh.triangles.size(), 2u * 128u * 128u + 1000u);
}

TEST(Contour, IsAsAccurateTenThousandKilometresOut) {
    VolumeWorld world = flat_world();
    world.lattice.origin_x = 1e7;
    const auto cave = place(VolumeOp::remove, VolumeSphere{20.0}, {1e7 + 63.7, 64.2, 15.0});
    const Volumes volumes = Volumes::create(world.lattice, std::vector{cave}).value();
    double worst = 0.0;
    for (const VolumeContour& contour : contour_all(world, volumes)) {
        for (const WorldPos& p : contour.positions_world) {
            worst = std::max(worst, std::abs(AnalyticSolid::distance(cave, p)));
        }
    }
    EXPECT_GT(worst, 0.0);
    EXPECT_LT(worst, 0.02);
}

TEST(JoinedMeshChecks, FindWhatIsBroken) {
    const VolumeWorld world = flat_world();
    const Joined joined(world, {place(VolumeOp::remove, VolumeSphere{9.0}, {64.0, 64.0, 38.0})});
    ASSERT_EQ(find_leak(world, joined.mesh), "");
    JoinedMesh missing = joined.mesh;
    missing.triangles.erase(missing.triangles.begin() + 100);
    EXPECT_NE(find_leak(world, missing).find("one triangle"), std::string::npos);
    JoinedMesh turned = joined.mesh;
    std::swap(turned.triangles[100][0], turned.triangles[100][1]);
    EXPECT_NE(find_leak(world, turned), "");
    JoinedMesh twice = joined.mesh;
    twice.triangles.push_back(twice.triangles[100]);
    EXPECT_NE(find_leak(world, twice).find("two triangles"), std::string::npos);
    JoinedMesh flat = joined.mesh;
    flat.triangles[100][0] = flat.triangles[100][1];
    EXPECT_NE(find_leak(world, flat), "");
    std::vector<VolumeContour> kept = joined.contours;
    for (VolumeContour& contour : kept) {
        if (!contour.replaced.empty()) contour.replaced.pop_back();
    }
    EXPECT_NE(find_leak(world, join(world, joined.volumes, kept)), "");
    for (VolumeContour& contour : kept) {
        if (!contour.positions_world.empty()) contour.positions_world.front().x() += 1e-9;
    }
    EXPECT_NE(find_leak(world, join(world, joined.volumes, kept)), "");
}

}  // namespace contour_test
}  // namespace terrane
