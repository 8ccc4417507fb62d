// SPDX-License-Identifier: MIT
#include "support/grounds.h"

#include <terrane/terrain/function_heights.h>
#include <terrane/terrain/mesh_buffers.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace terrane::mesh_buffers_test {

constexpr double kCurvature = 0.0012;

double hills(double x, double y) {
    return 30.0 * test::wave(x / 1000.0) + 6.0 * test::wave(y / 600.0);
}

// Frames of a flight over hills far from the origin.
class Flight {
public:
    explicit Flight(double x0 = 3e6)
        : source_(heights_from_function([x0](double x, double y) { return hills(x - x0, y); },
                                        {.extent = {x0 - 8000.0, -8000.0, x0 + 8000.0, 8000.0},
                                         .slope = 0.33,
                                         .curvature = kCurvature})
                      .value()),
          pager_(Pager::create(source_, {.worker_count = 0}).value()),
          triangulator_(
              Triangulator::create(*source_, {.triangle_budget = 20'000, .max_error_px = 2.0})
                  .value()),
          x0_(x0) {}

    TerrainMesh frame(const WorldPos& eye_from_middle) {
        eye_world = eye_from_middle + Eigen::Vector3d(x0_, 0.0, 0.0);
        camera_.view =
            look_at(eye_world, eye_world + Eigen::Vector3d(300.0, 900.0, -150.0), 1.0, 1280, 720)
                .value();
        pager_.update({&camera_, 1}, {}, time_ += 0.1);
        const TerrainMesh mesh = triangulator_.update(pager_.resident(), camera_.view);
        camera_.threshold_px = mesh.threshold_px;
        return mesh;
    }
    WorldPos eye_world;

private:
    std::shared_ptr<const HeightSource> source_;
    Pager pager_;
    Triangulator triangulator_;
    CameraNeed camera_;
    double x0_, time_ = 0.0;
};

using Place = std::array<float, 3>;
using Corners = std::array<Place, 3>;

// Rotates the corners so that the smallest comes first: their order then tells the orientation.
Corners turned(Corners corners) {
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    return corners;
}

std::vector<Corners> triangles_of(const MeshBuffers& buffers) {
    std::vector<Corners> triangles;
    for (const MeshPart& part : buffers.parts()) {
        for (std::size_t i = 0; i < part.indices.size(); i += 3) {
            triangles.push_back(turned({part.vertices[part.indices[i]].position,
                                        part.vertices[part.indices[i + 1]].position,
                                        part.vertices[part.indices[i + 2]].position}));
        }
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

// As docs/mesh_layout.md defines them.
std::vector<Corners> triangles_of(const TerrainMesh& mesh, const WorldPos& origin_world) {
    const Lattice& lattice = mesh.resident->lattice();
    std::vector<Corners> triangles;
    for (const MeshChunk& part : mesh.chunks) {
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            Corners corners;
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint16_t sample = mesh.indices[part.first_index + i + k];
                const LocalVec p =
                    to_local({lattice.x(part.chunk->corner.x + sample % 129 * part.chunk->step),
                              lattice.y(part.chunk->corner.y + sample / 129 * part.chunk->step),
                              part.displayed_height(sample, lattice.quantum)},
                             origin_world);
                corners[k] = {p.x(), p.y(), p.z()};
            }
            triangles.push_back(turned(corners));
        }
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

TEST(MeshBuffers, HoldTheTrianglesOfTheFrameOnceEach) {
    Flight flight;
    MeshBuffers buffers = MeshBuffers::create().value();
    for (int i = 0; i < 8; ++i) {
        const TerrainMesh mesh = flight.frame({10.0 * i, 25.0 * i, 120.0});
        buffers.update(mesh, flight.eye_world);
        EXPECT_GT(mesh.triangle_count, 500u);
        EXPECT_EQ(triangles_of(buffers), triangles_of(mesh, buffers.origin_world()));
    }
}

TEST(MeshBuffers, MeetAtTheSameBitsWhereChunksMeet) {
    Flight flight;
    MeshBuffers buffers = MeshBuffers::create().value();
    for (int i = 0; i < 4; ++i)
        buffers.update(flight.frame({0.0, 40.0 * i, 90.0}), flight.eye_world);
    std::map<std::pair<Place, Place>, int> edges;
    for (const Corners& corners : triangles_of(buffers)) {
        for (std::size_t i = 0; i < 3; ++i) ++edges[{corners[i], corners[(i + 1) % 3]}];
    }
    std::size_t open = 0;
    // open edges lie on the border of the world only, 4 x 16 km in steps of at most 10 m, not on the thousands between
    // chunks
    for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        const auto& [a, b] = edge;
        if (edges.contains({b, a})) continue;
        ++open;
        EXPECT_TRUE((a[0] == b[0] && std::abs(a[0]) > 7000.0f) ||
                    (a[1] == b[1] && std::abs(a[1]) > 7000.0f))
            << "an open edge at " << a[0] << ", " << a[1];
    }
    EXPECT_GT(open, 0u);
    EXPECT_GT(buffers.parts().size(), 6u);
}

// A renderer's copy of the buffers, which uploads only the reported changes.
using Copy = std::map<ChunkKey, std::pair<std::vector<MeshVertex>, std::vector<std::uint32_t>>>;

TEST(MeshBuffers, TellWhatHasChangedSinceTheFrameBefore) {
    Flight flight;
    MeshBuffers buffers = MeshBuffers::create({.rebase_distance = 700.0}).value();
    Copy copy;
    std::size_t same = 0, changed = 0, added = 0, gone = 0;
    for (int i = 0; i < 60; ++i) {
        // the camera rests in some frames
        const int step = i - i % 3;
        const double y = 30.0 * step;
        buffers.update(flight.frame({0.0, y, 100.0}), flight.eye_world);
        for (const ChunkKey& key : buffers.gone()) EXPECT_EQ(copy.erase(key), 1u);
        gone += buffers.gone().size();
        for (const MeshPart& part : buffers.parts()) {
            EXPECT_EQ(copy.contains(part.key), part.change != PartChange::added);
            if (part.change == PartChange::same) {
                ++same;
                continue;
            }
            ++(part.change == PartChange::added ? added : changed);
            std::vector<MeshVertex> vertices(part.vertices.begin(), part.vertices.end());
            std::vector<std::uint32_t> indices(part.indices.begin(), part.indices.end());
            const bool is_new =
                copy[part.key].first != vertices || copy[part.key].second != indices;
            EXPECT_TRUE(is_new);
            copy[part.key] = {std::move(vertices), std::move(indices)};
        }
        ASSERT_EQ(copy.size(), buffers.parts().size());
        for (const MeshPart& part : buffers.parts()) {
            const auto& [vertices, indices] = copy[part.key];
            ASSERT_FALSE(indices.empty());
            EXPECT_TRUE(std::ranges::equal(vertices, part.vertices));
            EXPECT_TRUE(std::ranges::equal(indices, part.indices));
        }
        EXPECT_TRUE(std::ranges::is_sorted(buffers.parts(), ResidentSet::Order{}, &MeshPart::key));
    }
    EXPECT_GT(same, 100u);
    EXPECT_GT(changed, 100u);
    EXPECT_GT(added, 10u);
    EXPECT_GT(gone, 0u);
}

TEST(MeshBuffers, UseEachOfTheirVertices) {
    Flight flight;
    MeshBuffers buffers = MeshBuffers::create().value();
    buffers.update(flight.frame({0.0, 0.0, 100.0}), flight.eye_world);
    for (const MeshPart& part : buffers.parts()) {
        std::uint32_t next = 0;
        for (const std::uint32_t index : part.indices) {
            EXPECT_LE(index, next);  // indices are numbered in order of first use
            if (index == next) ++next;
        }
        EXPECT_EQ(next, part.vertices.size());
        EXPECT_EQ(part.indices.size() % 3, 0u);
    }
}

TEST(MeshBuffers, MoveTheirOriginWithTheEyeAndOnlyThen) {
    Flight flight;
    MeshBuffers buffers = MeshBuffers::create({.rebase_distance = 100.0}).value();
    const TerrainMesh mesh = flight.frame({0.0, 0.0, 100.0});
    const WorldPos first = flight.eye_world;
    buffers.update(mesh, first);
    EXPECT_EQ(buffers.origin_world(), first);
    buffers.update(mesh, first + Eigen::Vector3d(99.0, 0.0, 0.0));
    EXPECT_EQ(buffers.origin_world(), first);
    for (const MeshPart& part : buffers.parts()) EXPECT_EQ(part.change, PartChange::same);
    buffers.update(mesh, {std::nan(""), 0.0, 0.0});
    buffers.update(mesh, {0.0, std::numeric_limits<double>::infinity(), 0.0});
    EXPECT_EQ(buffers.origin_world(), first);
    const WorldPos farther = first + Eigen::Vector3d(80.0, 0.0, 80.0);
    buffers.update(mesh, farther);
    EXPECT_EQ(buffers.origin_world(), farther);
    for (const MeshPart& part : buffers.parts()) EXPECT_EQ(part.change, PartChange::changed);
    EXPECT_TRUE(buffers.gone().empty());
}

TEST(MeshBuffers, AreEmptyForAMeshWithoutTriangles) {
    MeshBuffers buffers = MeshBuffers::create().value();
    buffers.update(TerrainMesh{}, {1.0, 2.0, 3.0});
    EXPECT_TRUE(buffers.parts().empty());
    Flight flight;
    buffers.update(flight.frame({0.0, 0.0, 100.0}), flight.eye_world);
    const std::size_t count = buffers.parts().size();
    EXPECT_GT(count, 0u);
    buffers.update(TerrainMesh{}, flight.eye_world);
    EXPECT_TRUE(buffers.parts().empty());
    EXPECT_EQ(buffers.gone().size(), count);
    EXPECT_TRUE(expand_mesh(TerrainMesh{}).triangles.empty());
    for (const double distance : {0.0, 1e7, std::nan("")}) {
        EXPECT_FALSE(MeshBuffers::create({.rebase_distance = distance}).has_value());
    }
}

TEST(MeshBuffers, HaveNormalsOfTheGroundAndNotOfItsTriangles) {
    Flight flight(0.0);
    MeshBuffers buffers = MeshBuffers::create().value();
    const TerrainMesh mesh = flight.frame({0.0, 0.0, 100.0});
    buffers.update(mesh, flight.eye_world);
    const Lattice& lattice = mesh.resident->lattice();
    std::map<std::pair<std::uint8_t, Place>, Place> seen;  // by level and position
    std::size_t shared = 0;
    for (const MeshPart& part : buffers.parts()) {
        const double spacing = lattice.level_spacing(part.key.level);
        for (const MeshVertex& vertex : part.vertices) {
            const Eigen::Vector3d normal(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
            EXPECT_NEAR(normal.norm(), 1.0, 1e-6);
            const double x = buffers.origin_world().x() + static_cast<double>(vertex.position[0]);
            const double y = buffers.origin_world().y() + static_cast<double>(vertex.position[1]);
            const double d = 0.5;
            const double slope_x = (hills(x + d, y) - hills(x - d, y)) / (2.0 * d);
            const double slope_y = (hills(x, y + d) - hills(x, y - d)) / (2.0 * d);
            // a difference quotient over one spacing is off by curvature times spacing
            const double allowed = kCurvature * (spacing + 1.0) + lattice.quantum / spacing;
            EXPECT_NEAR(-normal.x() / normal.z(), slope_x, allowed);
            EXPECT_NEAR(-normal.y() / normal.z(), slope_y, allowed);
            const auto [found, is_new] =
                seen.try_emplace({part.key.level, vertex.position}, vertex.normal);
            if (is_new) continue;
            ++shared;
            EXPECT_EQ(found->second, vertex.normal);  // on borders of chunks of one level
        }
    }
    EXPECT_GT(shared, 0u);
}

TEST(ExpandMesh, HasTheTrianglesOfTheFrameAndEachPositionOnce) {
    Flight flight;
    const TerrainMesh mesh = flight.frame({0.0, 0.0, 100.0});
    const TriangleMesh expanded = expand_mesh(mesh);
    EXPECT_EQ(expanded.triangles.size(), mesh.triangle_count);
    EXPECT_EQ(expanded.normals.size(), expanded.positions.size());
    std::map<std::array<double, 3>, int> places;
    for (const WorldPos& p : expanded.positions) {
        EXPECT_EQ(++places[(std::array<double, 3>{p.x(), p.y(), p.z()})], 1);
    }
    std::vector<Corners> triangles;
    for (const auto& triangle : expanded.triangles) {
        Corners corners;
        for (std::size_t i = 0; i < 3; ++i) {
            const LocalVec p = to_local(expanded.positions[triangle[i]], flight.eye_world);
            corners[i] = {p.x(), p.y(), p.z()};
        }
        triangles.push_back(turned(corners));
    }
    std::sort(triangles.begin(), triangles.end());
    EXPECT_EQ(triangles, triangles_of(mesh, flight.eye_world));
}

}  // namespace terrane::mesh_buffers_test
