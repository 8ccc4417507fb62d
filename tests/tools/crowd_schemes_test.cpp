// SPDX-License-Identifier: MIT
//
// The laboratory's broadphases against a comparison of all bodies, for bodies that no crowd has.
#include "lab/crowd.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace crowd_schemes_test {

using namespace test;

constexpr double kWidth = 80.0;  // of the room, metres
constexpr std::uint64_t kSeed = 20261129;

struct Spheres {
    std::string name;
    std::vector<Aabb> cubes;

    // Coordinates and radii are multiples of 1/8, so that cubes, squares and sums are exact.
    void add(const Eigen::Vector3d& centre, double radius) {
        const Eigen::Vector3d half = Eigen::Vector3d::Constant(radius);
        cubes.push_back({centre - half, centre + half});
    }
};

double eighths(Random& random, double low, double high) {
    return std::floor(8.0 * random.between(low, high)) / 8.0;
}

Eigen::Vector3d place(Random& random, double low, double high) {
    const double x = eighths(random, low, high), y = eighths(random, low, high);
    const double z = eighths(random, low, high);
    return {x, y, z};
}

std::vector<Spheres> make_spheres() {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Random random(kSeed);
    std::vector<Spheres> all;
    const auto named = [&all](std::string name) -> Spheres& {
        return all.emplace_back(Spheres{std::move(name), {}});
    };
    named("none");
    named("one").add({3.0, 4.0, 5.0}, 1.0);
    Spheres& two = named("two that touch across a border of cells");
    two.add({1.0, 1.0, 1.0}, 1.0);
    two.add({3.0, 1.0, 1.0}, 1.0);
    Spheres& apart = named("two whose cubes overlap at a corner");
    apart.add({1.0, 1.0, 1.0}, 1.0);
    apart.add({2.5, 2.5, 1.0}, 1.0);
    Spheres& spread = named("spread over the room");
    for (int i = 0; i < 600; ++i) spread.add(place(random, 0.0, kWidth), eighths(random, 0.5, 2.0));
    Spheres& lattice = named("on a lattice, touching");
    for (int i = 0; i < 343; ++i) {
        const int row = i / 7 % 7, layer = i / 49;
        lattice.add(2.0 * Eigen::Vector3d(i % 7, row, layer), 1.0);
    }
    Spheres& outside = named("outside the room, at negative coordinates");
    for (int i = 0; i < 300; ++i) outside.add(place(random, -60.0, -20.0), 1.0);
    for (int i = 0; i < 100; ++i) outside.add(place(random, 60.0, 200.0), 4.0);
    Spheres& giant = named("small ones and a giant");
    for (int i = 0; i < 300; ++i) giant.add(place(random, 0.0, kWidth), 0.125);
    giant.add({-400.0, 40.0, 40.0}, 420.0);
    Spheres& same = named("coincident");
    for (int i = 0; i < 30; ++i) same.add({7.0, 7.0, 7.0}, 0.125 * (i % 3));
    Spheres& points = named("points, some in one place");
    for (int i = 0; i < 200; ++i) points.add(place(random, 4.0, 4.5), 0.0);
    Spheres& huge = named("huge");
    huge.add(Eigen::Vector3d::Constant(0x1p480), 0x1p480);
    huge.add(Eigen::Vector3d::Constant(-0x1p480), 0x1p479);
    huge.add({0.0, 0.0, 0.0}, 1.0);
    huge.add({0.0, 0.0, 0x1p480}, 0x1p481);
    Spheres& broken = named("some without a box");
    for (int i = 0; i < 20; ++i) broken.add({0.5 * i, 0.0, 0.0}, 0.5);
    broken.cubes[3].low.y() = kNan;
    broken.cubes[4].high = Eigen::Vector3d::Constant(kNan);
    broken.cubes[5].high.z() = kInfinity;
    broken.cubes[6].low.x() = -kInfinity;
    std::swap(broken.cubes[7].low, broken.cubes[7].high);
    return all;
}

bool is_box(const Aabb& box) {
    return (box.low.array() <= box.high.array()).all() && box.low.allFinite() &&
           box.high.allFinite();
}

// All pairs of boxes that `meets` accepts, in order.
std::vector<BodyPair> compare_all(std::span<const Aabb> boxes,
                                  const std::function<bool(const Aabb&, const Aabb&)>& meets) {
    std::vector<BodyPair> pairs;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
            if (is_box(boxes[i]) && is_box(boxes[j]) && meets(boxes[i], boxes[j])) {
                pairs.push_back({i, j});
            }
        }
    }
    return pairs;
}

bool do_spheres_meet(const Aabb& a, const Aabb& b) {
    double square = 0.0;  // of twice the distance
    for (int axis = 0; axis < 3; ++axis) {
        const double d = (a.low[axis] + a.high[axis]) - (b.low[axis] + b.high[axis]);
        square += d * d;
    }
    const double reach = (a.high.x() - a.low.x()) + (b.high.x() - b.low.x());
    return square <= reach * reach;
}

std::vector<BodyPair> find(Broadphase& broadphase, std::span<const Aabb> bounds) {
    broadphase.update(bounds);
    const std::span<const BodyPair> pairs = broadphase.find_pairs();
    return {pairs.begin(), pairs.end()};
}

TEST(CentroidGrid, FindsTheSpheresThatMeetWhateverTheirNumberSizeAndPlace) {
    for (const Spheres& spheres : make_spheres()) {
        SCOPED_TRACE(spheres.name);
        const auto grid = make_scheme(CrowdScheme::centroid, kWidth, spheres.cubes.size());
        const std::vector<BodyPair> expected = compare_all(spheres.cubes, do_spheres_meet);
        // bodies that come back after others
        for (int time = 0; time < 2; ++time) {
            EXPECT_EQ(find(*grid, spheres.cubes), expected);
            EXPECT_GE(grid->candidate_count(), expected.size());
            find(*grid, std::vector<Aabb>(3, Aabb{{1, 1, 1}, {9, 9, 9}}));
        }
    }
}

TEST(CentroidGrid, ComparesTheBodiesOfTwentySevenCellsAsWideAsTheLargest) {
    Random random(kSeed + 1);
    Spheres spheres{"", {}};
    std::vector<Eigen::Vector3i> cells;
    // centres off the borders of cells of 2 m
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d centre =
            place(random, 0.0, 0.5 * kWidth) * 2.0 + Eigen::Vector3d::Constant(0.125);
        spheres.add(centre, i == 7 ? 1.0 : 0.5);
        cells.emplace_back((0.5 * centre.array()).floor().cast<int>());
    }
    std::uint64_t near = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        for (std::size_t j = i + 1; j < cells.size(); ++j) {
            near += (cells[i] - cells[j]).cwiseAbs().maxCoeff() <= 1 ? 1u : 0u;
        }
    }
    const auto grid = make_scheme(CrowdScheme::centroid, kWidth, spheres.cubes.size());
    find(*grid, spheres.cubes);
    EXPECT_GT(near, 300u);
    EXPECT_EQ(grid->candidate_count(), near);
    EXPECT_EQ(grid->update_operations(), 40u * 40u * 40u + 2000u);
}

TEST(CrowdSchemes, FindTheBoxesThatOverlapWhateverTheirNumberSizeAndPlace) {
    for (const Spheres& spheres : make_spheres()) {
        SCOPED_TRACE(spheres.name);
        if (spheres.name == "some without a box") continue;
        const std::vector<BodyPair> expected =
            compare_all(spheres.cubes, [](const Aabb& a, const Aabb& b) { return overlap(a, b); });
        for (const CrowdScheme scheme : kCrowdSchemes) {
            if (scheme == CrowdScheme::centroid) continue;
            const auto broadphase = make_scheme(scheme, kWidth, spheres.cubes.size());
            EXPECT_EQ(find(*broadphase, spheres.cubes), expected) << to_string(scheme);
        }
    }
}

}  // namespace crowd_schemes_test
}  // namespace terrane::tools
