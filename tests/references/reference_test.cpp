// SPDX-License-Identifier: MIT
#include "reference_maps.h"
#include "reference_meshes.h"
#include "support/mesh_checks.h"
#include "support/random.h"
#include "terrain/source/bound_checks.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

namespace terrane::test {
namespace reference_maps_test {

HeightTable rough_table(int columns, int rows, std::uint64_t seed) {
    HeightTable table;
    table.columns = columns;
    table.rows = rows;
    Random random(seed);
    for (int i = 0; i < columns * rows; ++i) {
        table.heights.push_back(static_cast<float>(random.between(-20.0, 30.0)));
    }
    return table;
}

// The formula of the maps for one sample, spelled out.
double fbm_height(int x, int y) {
    const auto mix = [](std::uint32_t h) {
        h ^= h >> 16;
        h *= 0x7feb352du;
        h ^= h >> 15;
        h *= 0x846ca68bu;
        h ^= h >> 16;
        return h;
    };
    const auto fade = [](double t) {
        return 6 * std::pow(t, 5) - 15 * std::pow(t, 4) + 10 * t * t * t;
    };
    double height = 0.0;
    for (std::uint32_t octave = 0; octave < 10; ++octave) {
        const double u = x * std::pow(2.0, octave) / 512 + 17.31 * octave;
        const double v = y * std::pow(2.0, octave) / 512 + 9.77 * octave;
        double noise = 0.0;
        for (const int dy : {0, 1}) {
            for (const int dx : {0, 1}) {
                const double i = std::floor(u) + dx, j = std::floor(v) + dy;
                const std::uint32_t hash =
                    mix(static_cast<std::uint32_t>(i) * 0x8da6b343u ^
                        static_cast<std::uint32_t>(j) * 0xd8163841u ^ octave * 0xcb1ab31fu);
                const double angle = 2.0 * std::acos(-1.0) * hash / 4294967296.0;
                const double weight = fade(1.0 - std::abs(u - i)) * fade(1.0 - std::abs(v - j));
                noise += weight * (std::cos(angle) * (u - i) + std::sin(angle) * (v - j));
            }
        }
        height += 100.0 * std::pow(0.5, octave) * noise;
    }
    return height;
}

TEST(ReferenceMap, OfContactIsAsSteepAsItsFiguresSay) {
    const HeightTable table = make_contact_table(1025, 1.0);
    double sum = 0.0, steepest = 0.0;
    for (int y = 0; y + 1 < table.rows; ++y) {
        for (int x = 0; x + 1 < table.columns; ++x) {
            const double here = static_cast<double>(table.at(x, y));
            const double slope = std::hypot(static_cast<double>(table.at(x + 1, y)) - here,
                                            static_cast<double>(table.at(x, y + 1)) - here);
            sum += slope;
            steepest = std::max(steepest, slope);
        }
    }
    EXPECT_NEAR(sum / (1024.0 * 1024.0), 0.375, 0.0005);
    EXPECT_NEAR(steepest, 1.59, 0.005);
}

TEST(ReferenceMap, OfContactHasTheSameHillsAtEverySpacing) {
    const HeightTable coarse = make_contact_table(9, 1.0);
    const HeightTable fine = make_contact_table(33, 0.25);
    for (int y = 0; y < 9; ++y) {
        for (int x = 0; x < 9; ++x) EXPECT_EQ(coarse.at(x, y), fine.at(4 * x, 4 * y));
    }
}

TEST(ReferenceMap, FollowsItsFormula) {
    const HeightTable table = make_fbm_table(257);
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const int x = random.below(257), y = random.below(257);
        EXPECT_NEAR(static_cast<double>(table.at(x, y)), fbm_height(x, y), 1e-4) << x << ", " << y;
    }
}

TEST(TableHeights, BoundsWhatItsDiamondsMeasureAndNotMuchMore) {
    const TableHeights source(rough_table(129, 129, 2));
    Random random(3);
    double closest = 0.0;
    for (const std::int64_t step : {1, 2, 4, 16}) {
        for (int i = 0; i < 4; ++i) {
            const SampleGrid grid{{32 * random.below(3), 32 * random.below(3)},
                                  step,
                                  static_cast<int>(32 / step) + 1,
                                  static_cast<int>(32 / step) + 1};
            closest = std::max(closest, check_bounds(source, grid, 60, random));
        }
    }
    EXPECT_GT(closest, 0.97);
}

// Dense points of the finest diamonds, where the bend within a cell decides.
TEST(TableHeights, BoundsOfTheFinestDiamondsAreExact) {
    const TableHeights source(rough_table(129, 129, 4));
    const std::vector<float> bounds = vertex_bounds(source, {{64, 64}, 1, 9, 9});
    for (int row = 0; row < 9; ++row) {
        for (int column = 0; column < 9; ++column) {
            if (((row | column) & 1) == 0 || (row & column & 1) != 0) continue;
            double dense = 0.0;  // a midpoint has nothing below it
            for (const Triangle& triangle : diamond(64 + column, 64 + row, 1)) {
                for (int i = 0; i <= 400; ++i) {
                    for (int j = 0; i + j <= 400; ++j) {
                        const double a = i / 400.0, b = j / 400.0, c = 1.0 - a - b;
                        const auto mixed = [&](auto&& of) {
                            return a * of(triangle[0]) + b * of(triangle[1]) + c * of(triangle[2]);
                        };
                        const double x = mixed([](const LatticePoint& p) { return double(p.x); });
                        const double y = mixed([](const LatticePoint& p) { return double(p.y); });
                        const double plane = mixed([&](const LatticePoint& p) {
                            return source.height(double(p.x), double(p.y));
                        });
                        dense = std::max(dense, std::abs(source.height(x, y) - plane));
                    }
                }
            }
            const auto bound =
                static_cast<double>(bounds[static_cast<std::size_t>(9 * row + column)]);
            EXPECT_LE(dense, bound);
            EXPECT_GE(dense, bound - 1e-3);
        }
    }
}

TEST(TableHeights, NestsItsBoundsAndGivesTheSameBitsToEveryGrid) {
    const TableHeights source(rough_table(300, 200, 5));
    for (const std::int64_t step : {2, 4, 8}) {
        check_nesting(source, {{16, 32}, step, 9, 9});
        check_same_bits(source, {{16, 32}, step, 9, 9});
    }
    check_same_bits(source, {{-4, 180}, 1, 20, 40});
}

TEST(TableHeights, HoldsEveryHeightInItsIntervalsAndRises) {
    const TableHeights source(rough_table(300, 200, 6));
    EXPECT_EQ(source.lattice().root_count_x, 3);
    EXPECT_EQ(source.lattice().root_count_y, 2);
    EXPECT_EQ(source.extent().east, 299.0);
    Random random(7);
    for (int i = 0; i < 2000; ++i) {
        const double west = random.between(-40.0, 400.0), south = random.between(-40.0, 280.0);
        const WorldRect rect{west, south, west + random.between(0.0, 60.0),
                             south + random.between(0.0, 60.0)};
        const HeightInterval held = source.interval(rect);
        const double x0 = random.between(rect.west, rect.east);
        const double y0 = random.between(rect.south, rect.north);
        const double x1 = random.between(rect.west, rect.east);
        const double y1 = random.between(rect.south, rect.north);
        const double from = source.height(x0, y0), to = source.height(x1, y1);
        EXPECT_LE(held.low, from);
        EXPECT_GE(held.high, from);
        EXPECT_LE(std::abs(to - from), source.rise_bound(std::hypot(x1 - x0, y1 - y0)));
    }
}

TEST(TableHeights, MakesChunksWhoseEdgesAreShared) {
    const TableHeights source(make_fbm_table(257));
    EXPECT_EQ(source.lattice().finest_level, 1);
    EXPECT_EQ(source.lattice().root_count_x, 1);
    const auto west = make_chunk(source, {0, 1, 1}).value();
    const auto east = make_chunk(source, {1, 1, 1}).value();
    for (int row = 0; row < kChunkSamples; ++row) {
        EXPECT_EQ(west->heights[sample_index(kChunkCells, row)],
                  east->heights[sample_index(0, row)]);
    }
}

}  // namespace reference_maps_test

namespace reference_meshes_test {

using Edge = std::pair<std::array<int, 2>, std::array<int, 2>>;

// Each inner edge in two triangles, once in each direction; each border edge in one.
bool is_conforming(const TableMesh& mesh, const HeightTable& table) {
    std::map<Edge, int> uses;
    for (const auto& triangle : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            ++uses[{mesh.vertices[triangle[k]], mesh.vertices[triangle[(k + 1) % 3]]}];
        }
    }
    for (const auto& [edge, count] : uses) {
        const auto& [a, b] = edge;
        const bool on_border = (a[0] == b[0] && (a[0] == 0 || a[0] == table.columns - 1)) ||
                               (a[1] == b[1] && (a[1] == 0 || a[1] == table.rows - 1));
        const auto back = uses.find({b, a});
        const int others = back == uses.end() ? 0 : back->second;
        if (count != 1 || others != (on_border ? 0 : 1)) return false;
    }
    return true;
}

// By looking at every sample against every triangle.
double slow_error(const HeightTable& table, const TableMesh& mesh) {
    double worst = 0.0;
    for (int y = 0; y < table.rows; ++y) {
        for (int x = 0; x < table.columns; ++x) {
            bool covered = false;
            for (const auto& triangle : mesh.triangles) {
                const auto& a = mesh.vertices[triangle[0]];
                const auto& b = mesh.vertices[triangle[1]];
                const auto& c = mesh.vertices[triangle[2]];
                const auto cross = [](const auto& p, const auto& q, double u, double v) {
                    return (q[0] - p[0]) * (v - p[1]) - (u - p[0]) * (q[1] - p[1]);
                };
                const double area = cross(a, b, c[0], c[1]);
                const double wa = cross(b, c, x, y) / area, wb = cross(c, a, x, y) / area;
                const double wc = cross(a, b, x, y) / area;
                if (wa < 0.0 || wb < 0.0 || wc < 0.0) continue;
                covered = true;
                const double plane = wa * static_cast<double>(table.at(a[0], a[1])) +
                                     wb * static_cast<double>(table.at(b[0], b[1])) +
                                     wc * static_cast<double>(table.at(c[0], c[1]));
                worst = std::max(worst, std::abs(plane - static_cast<double>(table.at(x, y))));
            }
            if (!covered) return -1.0;
        }
    }
    return worst;
}

TEST(ReferenceMesh, GreedyTinMeetsItsToleranceAndConforms) {
    const HeightTable table = make_fbm_table(65);
    for (const double tolerance : {8.0, 1.0, 0.1, 0.0}) {
        const TableMesh mesh = make_greedy_tin(table, tolerance);
        EXPECT_TRUE(is_conforming(mesh, table));
        EXPECT_LE(measure_error(table, mesh), tolerance == 0.0 ? 1e-9 : tolerance);
        if (tolerance < 1.0) continue;
        EXPECT_NEAR(slow_error(table, mesh), measure_error(table, mesh), 1e-9);
    }
}

TEST(ReferenceMesh, GreedyTinIsDelaunay) {
    const TableMesh mesh = make_greedy_tin(make_fbm_table(65), 0.5);
    ASSERT_GT(mesh.triangles.size(), 40u);
    for (const auto& triangle : mesh.triangles) {
        const auto& a = mesh.vertices[triangle[0]];
        const auto& b = mesh.vertices[triangle[1]];
        const auto& c = mesh.vertices[triangle[2]];
        const double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
        const double d = 2.0 * (bx * cy - by * cx);
        const double ux = (cy * (bx * bx + by * by) - by * (cx * cx + cy * cy)) / d;
        const double uy = (bx * (cx * cx + cy * cy) - cx * (bx * bx + by * by)) / d;
        for (const auto& p : mesh.vertices) {
            EXPECT_GE(std::hypot(p[0] - a[0] - ux, p[1] - a[1] - uy), std::hypot(ux, uy) - 1e-6);
        }
    }
}

TEST(ReferenceMesh, MinimalClosureMeetsItsToleranceAndConforms) {
    const HeightTable table = make_fbm_table(65);
    std::size_t before = 0;
    for (const double tolerance : {8.0, 1.0, 0.1, 0.0}) {
        const TableMesh mesh = make_minimal_closure(table, tolerance);
        EXPECT_TRUE(is_conforming(mesh, table));
        EXPECT_LE(measure_error(table, mesh), tolerance == 0.0 ? 1e-9 : tolerance);
        EXPECT_GT(mesh.triangles.size(), before);
        before = mesh.triangles.size();
    }
    EXPECT_EQ(before, 2u * 64 * 64);
}

// A spike needs its own chain of parents and nothing else: 2 triangles, and 2 for each inner
// vertex.
TEST(ReferenceMesh, MinimalClosureOfASpikeIsItsParents) {
    HeightTable table;
    table.columns = table.rows = 9;
    table.heights.assign(81, 0.0f);
    table.heights[table.index(4, 4)] = 1.0f;
    // the centre, and what splits every triangle around it that holds no more than flat ground
    EXPECT_EQ(make_minimal_closure(table, 1.5).triangles.size(), 2u);
    EXPECT_EQ(make_minimal_closure(table, 1.0).triangles.size(), 2u);
    const TableMesh all = make_minimal_closure(table, 0.01);
    EXPECT_LE(measure_error(table, all), 0.01);
    EXPECT_LT(all.triangles.size(), 2u * 64);
}

TEST(ReferenceMesh, MeasuresAnErrorThatIsThere) {
    HeightTable table = make_fbm_table(33);
    TableMesh mesh = make_minimal_closure(table, 0.0);
    EXPECT_LT(measure_error(table, mesh), 1e-9);
    table.heights[table.index(17, 5)] += 3.0f;
    TableMesh flat = make_minimal_closure(make_fbm_table(33), 2.0);
    EXPECT_GT(measure_error(table, flat), 0.9);
    mesh.triangles.pop_back();
    EXPECT_TRUE(std::isinf(measure_error(table, mesh)));
}

class SoarFrame : public testing::Test {
protected:
    TableHeights source{make_fbm_table(129)};
    View view = look_at({40.0, 30.0, 60.0}, {90.0, 100.0, 0.0}, 1.0, 1280, 720).value();

    TableMesh mesh_of(const SoarReference& soar) const {
        TableMesh mesh;
        for (int y = 0; y < 129; ++y) {
            for (int x = 0; x < 129; ++x) mesh.vertices.push_back({x, y});
        }
        for (std::size_t i = 0; i < soar.indices().size(); i += 3) {
            mesh.triangles.push_back(
                {soar.indices()[i], soar.indices()[i + 1], soar.indices()[i + 2]});
        }
        return mesh;
    }

    /// Largest screen error of a sample inside the side planes.
    double measure_px(const TableMesh& mesh) const {
        const Frustum frustum = make_frustum(view);
        double worst = 0.0;
        for (const auto& triangle : mesh.triangles) {
            std::array<Eigen::Vector3d, 3> p;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto& v = mesh.vertices[triangle[k]];
                p[k] = {double(v[0]), double(v[1]), double(source.padded().at(v[0], v[1]))};
            }
            for (int i = 0; i <= 16; ++i) {
                for (int j = 0; i + j <= 16; ++j) {
                    const Eigen::Vector3d shown =
                        p[0] + i / 16.0 * (p[1] - p[0]) + j / 16.0 * (p[2] - p[0]);
                    const Eigen::Vector3d truth(shown.x(), shown.y(),
                                                source.height(shown.x(), shown.y()));
                    const Eigen::Vector3d from_eye = truth - view.eye_world;
                    bool inside = true;
                    for (const auto& normal : frustum.normals)
                        inside &= normal.dot(from_eye) >= 0.0;
                    if (!inside) continue;
                    worst = std::max(worst, std::abs(shown.z() - truth.z()) *
                                                view.pixels_per_radian() / from_eye.norm());
                }
            }
        }
        return worst;
    }
};

TEST_F(SoarFrame, IsConformingAndErrsLessThanItsThreshold) {
    SoarReference soar(source);
    soar.refine(view, 0.0);
    const double finest = measure_px(mesh_of(soar));  // cells are bent, and cannot be split
    ASSERT_LT(finest, 2.0);
    for (const bool culls : {true, false}) {
        soar.culls = culls;
        for (const double tau : {20.0, 5.0, 2.0}) {
            const std::size_t count = soar.refine(view, tau);
            const TableMesh mesh = mesh_of(soar);
            EXPECT_EQ(count, mesh.triangles.size());
            EXPECT_TRUE(is_conforming(mesh, source.padded()));
            EXPECT_FALSE(std::isinf(measure_error(source.padded(), mesh)));
            const double measured = measure_px(mesh);
            EXPECT_LE(measured, tau);
            EXPECT_GE(measured, 0.3 * tau);
        }
    }
}

TEST_F(SoarFrame, FillsItsBudgetAndNeverMore) {
    SoarReference soar(source);
    for (const std::size_t budget : {2u, 3u, 100u, 2'000u, 8'000u, 2'500u}) {
        const std::size_t count = soar.refine_to_budget(view, budget);
        EXPECT_LE(count, budget);
        EXPECT_GE(count + 4, budget);
        EXPECT_TRUE(is_conforming(mesh_of(soar), source.padded()));
    }
    EXPECT_EQ(soar.refine_to_budget(view, 1'000'000), soar.refine(view, 1e-7));
}

TEST_F(SoarFrame, CullingLeavesTrianglesOutOfViewCoarse) {
    SoarReference soar(source);
    const std::size_t culled = soar.refine(view, 1.0);
    soar.culls = false;
    EXPECT_LT(culled, soar.refine(view, 1.0));
}

}  // namespace reference_meshes_test
}  // namespace terrane::test
