// SPDX-License-Identifier: MIT
//
// A hand-made pit and a closed cave in rough ground, against brute force over all triangles.
#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::solid_test {

using namespace test;

constexpr std::uint64_t kSeed = 41;
constexpr int kWest = 30, kEast = 37, kSouth = 50, kNorth = 53;  // cells of the pit, inclusive
constexpr double kPitFloor = -20.0;
constexpr double kCaveFloor = -30.0, kCaveCeiling = -24.0;  // of a box below the pit and beside it
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double rough(double x, double y) { return 3.0 * std::sin(1.7 * x) + 2.0 * std::cos(2.3 * y + x); }

class Builder {
public:
    explicit Builder(const Chunk& chunk, double quantum) : chunk_(chunk), quantum_(quantum) {}

    void add_pit() {
        for (int row = kSouth; row <= kNorth; ++row) {
            for (int column = kWest; column <= kEast; ++column) {
                const auto cell = static_cast<std::uint16_t>(2 * cell_index(column, row));
                result_.replaced.push_back(cell);
                result_.replaced.push_back(static_cast<std::uint16_t>(cell + 1));
                add_quad(floor(column, row), floor(column + 1, row), floor(column + 1, row + 1),
                         floor(column, row + 1));
            }
        }
        for (int column = kWest; column <= kEast; ++column) {
            add_wall(column + 1, kSouth, column, kSouth);
            add_wall(column, kNorth + 1, column + 1, kNorth + 1);
        }
        for (int row = kSouth; row <= kNorth; ++row) {
            add_wall(kWest, row, kWest, row + 1);
            add_wall(kEast + 1, row + 1, kEast + 1, row);
        }
    }
    void add_cave() {
        const double west = 28.5, east = 45.25, south = 47.5, north = 60.5;
        const auto corner = [&](int i) -> Eigen::Vector3d {
            return {(i & 1) != 0 ? east : west, (i & 2) != 0 ? north : south,
                    (i & 4) != 0 ? kCaveCeiling : kCaveFloor};
        };
        // Counter-clockwise from inside the cave, which is outside the solid.
        const int faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4},
                                 {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}};
        for (const auto& face : faces) {
            add_quad(corner(face[0]), corner(face[1]), corner(face[2]), corner(face[3]));
        }
    }
    std::shared_ptr<const SolidSurface> finish() {
        result_.parts.assign(result_.triangles.size(), SolidPart::cavity);
        result_.error_m = 0.25;
        return std::make_shared<const SolidSurface>(std::move(result_));
    }

private:
    Eigen::Vector3d rim(int column, int row) const {
        return {static_cast<double>(column), static_cast<double>(row),
                quantum_ * chunk_.heights[sample_index(column, row)]};
    }
    static Eigen::Vector3d floor(int column, int row) {
        return {static_cast<double>(column), static_cast<double>(row), kPitFloor};
    }
    void add_wall(int from_column, int from_row, int to_column, int to_row) {
        add_quad(floor(to_column, to_row), floor(from_column, from_row), rim(from_column, from_row),
                 rim(to_column, to_row));
    }
    void add_quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  const Eigen::Vector3d& d) {
        const auto first = static_cast<std::uint32_t>(result_.vertices_world.size());
        for (const Eigen::Vector3d& p : {a, b, c, d}) result_.vertices_world.push_back(p);
        result_.triangles.push_back({first, first + 1, first + 2});
        result_.triangles.push_back({first, first + 2, first + 3});
    }

    const Chunk& chunk_;
    double quantum_;
    SolidTriangles result_;
};

struct Scene {
    std::shared_ptr<const SolidSurface> solid;
    Ground ground;
};

/// Two by two chunks; the south-western one has a pit and a cave.
Scene make_scene() {
    std::shared_ptr<const SolidSurface> solid;
    TableGroundSettings settings{.roots = 2};
    settings.solid = [&](const Chunk& chunk) -> std::shared_ptr<const SolidSurface> {
        if (chunk.key.x != 0 || chunk.key.y != 0) return nullptr;
        Builder builder(chunk, settings.quantum);
        builder.add_pit();
        builder.add_cave();
        solid = builder.finish();
        return solid;
    };
    Ground ground = make_test_ground(rough, settings);
    return {solid, std::move(ground)};
}

/// All triangles of the surface over the cells around pit and cave.
std::vector<CornerTriangle> all_triangles(const Scene& scene) {
    std::vector<CornerTriangle> all = triangles_of(scene.ground, {20, 40, 60, 70});
    const SolidTriangles& own = scene.solid->triangles();
    for (const auto& [a, b, c] : own.triangles) {
        all.push_back({own.vertices_world[a], own.vertices_world[b], own.vertices_world[c]});
    }
    return all;
}

TEST(JoinedSolid, AnswersTheHighestSurfaceAndTheNextOneDown) {
    const Scene scene = make_scene();
    const Ground& ground = scene.ground;
    const Ground plain = make_test_ground(rough, 1.0, 2);
    const HeightAnswer in_pit = ground.height(33.3, 51.7);
    EXPECT_EQ(in_pit.status, QueryStatus::ok);
    EXPECT_NEAR(in_pit.height, kPitFloor, 1e-12);
    EXPECT_TRUE(in_pit.normal.isApprox(Eigen::Vector3d::UnitZ()));
    EXPECT_EQ(in_pit.error_m, 0.25);
    // Beside the pit, over the cave.
    const HeightAnswer above = ground.height(40.4, 55.2);
    EXPECT_EQ(above.height, plain.height(40.4, 55.2).height);
    const HeightAnswer ceiling = ground.height_below(40.4, 55.2, above.height - 1e-9);
    EXPECT_EQ(ceiling.status, QueryStatus::ok);
    EXPECT_NEAR(ceiling.height, kCaveCeiling, 1e-12);
    EXPECT_LT(ceiling.normal.z(), -0.999);
    const HeightAnswer floor = ground.height_below(40.4, 55.2, kCaveCeiling - 1.0);
    EXPECT_NEAR(floor.height, kCaveFloor, 1e-12);
    EXPECT_GT(floor.normal.z(), 0.999);
    EXPECT_EQ(ground.height_below(40.4, 55.2, kCaveFloor - 1.0).status, QueryStatus::miss);
    // A chunk without volumes.
    EXPECT_EQ(ground.height_below(200.5, 200.5, 100.0).height, ground.height(200.5, 200.5).height);
    EXPECT_EQ(ground.height_below(200.5, 200.5, -100.0).status, QueryStatus::miss);
    EXPECT_EQ(ground.height_below(200.5, 200.5, std::nan("")).status, QueryStatus::invalid);
    EXPECT_EQ(ground.height_below(-5.0, 20.0, 100.0).status, QueryStatus::outside);
}

TEST(JoinedSolid, HasAHeightOnEveryEdgeOfItsTriangles) {
    const Scene scene = make_scene();
    for (int row = 2 * kSouth - 4; row <= 2 * kNorth + 6; ++row) {
        for (int column = 2 * kWest - 4; column <= 2 * kEast + 6; ++column) {
            const HeightAnswer answer = scene.ground.height(0.5 * column, 0.5 * row);
            ASSERT_EQ(answer.status, QueryStatus::ok) << column << ", " << row;
            const bool is_beyond = column < 2 * kWest || column > 2 * (kEast + 1) ||
                                   row < 2 * kSouth || row > 2 * (kNorth + 1);
            const bool is_inside = column > 2 * kWest && column < 2 * (kEast + 1) &&
                                   row > 2 * kSouth && row < 2 * (kNorth + 1);
            if (is_beyond) {
                EXPECT_GT(answer.height, -6.0);
            }
            if (is_inside) {
                EXPECT_NEAR(answer.height, kPitFloor, 1e-12);
            }
        }
    }
}

TEST(JoinedSolid, RaysMeetTheFirstTriangle) {
    const Scene scene = make_scene();
    const std::vector<CornerTriangle> triangles = all_triangles(scene);
    SeededRandom random(kSeed);
    int hits = 0;
    for (int i = 0; i < 4000; ++i) {
        const auto point = [&]() -> WorldPos {
            return {random.between(21.0, 60.0), random.between(41.0, 70.0),
                    random.between(-40.0, 10.0)};
        };
        const WorldPos from = point();
        WorldPos to = point();
        if (i % 5 == 0) to.head<2>() = from.head<2>();
        const RayAnswer answer = scene.ground.ray(from, to);
        const std::optional<double> expected = first_hit(triangles, from, to);
        ASSERT_EQ(answer.status, expected ? QueryStatus::ok : QueryStatus::miss) << i;
        if (!expected) continue;
        ASSERT_NEAR(answer.fraction, *expected, 1e-9) << i;
        ++hits;
    }
    EXPECT_GT(hits, 1000);
}

TEST(JoinedSolid, NoRayLeavesACaveThroughAnEdge) {
    const Scene scene = make_scene();
    const WorldPos inside(36.9, 54.1, -27.3);
    const SolidTriangles& own = scene.solid->triangles();
    long edges = 0;
    for (const auto& triangle : own.triangles) {
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d& a = own.vertices_world[triangle[static_cast<std::size_t>(k)]];
            const Eigen::Vector3d& b =
                own.vertices_world[triangle[static_cast<std::size_t>((k + 1) % 3)]];
            if (std::max(a.z(), b.z()) > kCaveCeiling) continue;  // an edge of the pit
            ++edges;
            for (const double share : {0.0, 0.25, 0.5, 1.0 / 3.0}) {
                const WorldPos target = a + share * (b - a);
                const RayAnswer answer = scene.ground.ray(inside, inside + 1.5 * (target - inside));
                ASSERT_EQ(answer.status, QueryStatus::ok);
                ASSERT_NEAR(answer.fraction, 1.0 / 1.5, 1e-9);
            }
        }
    }
    EXPECT_GT(edges, 9);
}

TEST(JoinedSolid, ARayOverAPitOfAnotherChunkIsNotDisturbed) {
    const Scene scene = make_scene();
    // Down into the pit, across it, and far over the border of the chunk.
    const RayAnswer through = scene.ground.ray({33.0, 52.0, -10.0}, {133.0, 130.0, -10.0});
    EXPECT_EQ(through.status, QueryStatus::ok);
    EXPECT_LT(through.point_world.x(), kEast + 1.0 + 1e-9);
    const RayAnswer over = scene.ground.ray({33.0, 52.0, 20.0}, {233.0, 150.0, 20.0});
    EXPECT_EQ(over.status, QueryStatus::miss);
    // A segment below everything, inside the solid, hits nothing.
    const RayAnswer below = scene.ground.ray({10.0, 10.0, -60.0}, {250.0, 240.0, -60.0});
    EXPECT_EQ(below.status, QueryStatus::miss);
    const RayAnswer up = scene.ground.ray({200.0, 200.0, -60.0}, {200.0, 200.0, 60.0});
    EXPECT_NEAR(up.point_world.z(), scene.ground.height(200.0, 200.0).height, 1e-9);
}

TEST(JoinedSolid, ARayThroughAHoleGoesOnBelowTheHeightfield) {
    TableGroundSettings settings{.roots = 2};
    settings.solid = [](const Chunk& chunk) {
        SolidTriangles hole;
        if (chunk.key.x == 0 && chunk.key.y == 0) {
            for (const std::size_t i : {0u, 1u}) {
                hole.replaced.push_back(static_cast<std::uint16_t>(2 * cell_index(100, 100) + i));
            }
        }
        return std::make_shared<const SolidSurface>(std::move(hole));
    };
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
    // Down through the hole from above intact cells to below intact cells, inside the chunk and beyond it.
    const WorldPos above(98.5, 100.4, 0.6);
    EXPECT_EQ(ground.ray(above, {102.5, 100.4, -0.6}).status, QueryStatus::miss);
    EXPECT_EQ(ground.ray(above, {198.5, 100.4, -29.4}).status, QueryStatus::miss);
    // Upwards again through the heightfield.
    const WorldPos below(100.2, 100.4, -0.5);
    EXPECT_NEAR(ground.ray(below, {110.2, 100.4, 0.5}).fraction, 0.5, 1e-12);
    EXPECT_EQ(ground.height(100.5, 100.5).status, QueryStatus::miss);
}

TEST(JoinedSolid, CellsAreTheSameOnlyOnTheSameLatticeAndExtent) {
    std::shared_ptr<const Chunk> chunk;
    TableGroundSettings settings;
    settings.solid = [&](const Chunk& made) -> std::shared_ptr<const SolidSurface> {
        chunk = std::make_shared<const Chunk>(made);
        return nullptr;
    };
    const Lattice lattice = make_test_ground(rough, settings).lattice();
    const WorldRect extent{0.0, 0.0, 128.0, 128.0};
    const auto make = [&](const Lattice& on, const WorldRect& within) {
        return Ground(std::make_shared<const ResidentSet>(
                          on, within, std::vector<std::shared_ptr<const Chunk>>{chunk}, 1u),
                      0);
    };
    const Ground ground = make(lattice, extent);
    const CellRange cells{10, 10, 20, 20};
    EXPECT_TRUE(ground.has_same_cells(make(lattice, extent), cells));
    Lattice moved = lattice, higher = lattice;
    moved.origin_x -= 4.0;
    higher.quantum *= 2.0;
    EXPECT_FALSE(ground.has_same_cells(make(moved, {-4.0, 0.0, 124.0, 128.0}), cells));
    EXPECT_FALSE(ground.has_same_cells(make(higher, extent), cells));
    EXPECT_FALSE(ground.has_same_cells(make(lattice, {0.0, 0.0, 15.0, 128.0}), cells));
    EXPECT_FALSE(ground.has_same_cells(make_test_ground(rough, 1.0, 1), cells));
}

TEST(JoinedSolid, AHeightThatIsAskedForAgainIsFound) {
    const Scene scene = make_scene();
    Random random(kSeed);
    for (int i = 0; i < 20000; ++i) {
        const double x = random.between(25.0, 50.0), y = random.between(45.0, 62.0);
        const HeightAnswer answer = scene.ground.height(x, y);
        ASSERT_NEAR(scene.ground.height_below(x, y, answer.height).height, answer.height, 1e-12)
            << i;
    }
}

TEST(JoinedSolid, WithoutTrianglesMeetsNothing) {
    const SolidSurface empty{SolidTriangles{}};
    EXPECT_FALSE(empty.ray({0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 0.0, 1.0));
    EXPECT_FALSE(empty.highest(0.0, 0.0, kInfinity));
    const Scene scene = make_scene();
    EXPECT_FALSE(scene.solid->ray({36.0, 54.0, -27.0}, {0.0, 0.0, 0.0}, 0.0, 1.0));
    EXPECT_FALSE(scene.solid->highest(std::nan(""), 54.0, kInfinity));
}

}  // namespace terrane::solid_test
