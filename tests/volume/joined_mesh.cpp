// SPDX-License-Identifier: MIT
#include "volume/joined_mesh.h"

#include "support/meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

namespace terrane::test {
namespace {

/// Samples of a cell's triangles: column and row offsets.
using Corner = std::array<int, 2>;
std::array<std::array<Corner, 3>, 2> cell_triangles(int column, int row) {
    if (cut_to_north_east(column, row)) {
        return {{{{{0, 0}, {1, 0}, {1, 1}}}, {{{0, 0}, {1, 1}, {0, 1}}}}};
    }
    return {{{{{0, 0}, {1, 0}, {0, 1}}}, {{{1, 0}, {1, 1}, {0, 1}}}}};
}

bool on_one_border(const VolumeWorld& world, const VolumeVertexKey& a, const VolumeVertexKey& b) {
    const auto all_at = [&](std::int64_t VolumeNode::*axis, std::int64_t at) {
        return a.first.*axis == at && a.second.*axis == at && b.first.*axis == at &&
               b.second.*axis == at;
    };
    return all_at(&VolumeNode::column, 0) || all_at(&VolumeNode::column, world.columns - 1) ||
           all_at(&VolumeNode::row, 0) || all_at(&VolumeNode::row, world.rows - 1);
}

std::string text(const VolumeVertexKey& key) {
    std::ostringstream out;
    for (const VolumeNode& n : {key.first, key.second})
        out << '(' << n.column << ' ' << n.row << ' ' << n.k << ')';
    return out.str();
}

}  // namespace

VolumeWorld VolumeWorld::make(int chunk_columns, double spacing,
                              const std::function<double(int, int)>& height) {
    VolumeWorld world;
    world.lattice.spacing = spacing;
    world.lattice.root_count_x = chunk_columns;
    world.lattice.quantum = 0x1p-12;
    world.columns = chunk_columns * kChunkCells + 1;
    world.rows = kChunkSamples;
    for (int row = 0; row < world.rows; ++row) {
        for (int column = 0; column < world.columns; ++column) {
            world.heights.push_back(static_cast<std::int32_t>(
                std::lround(height(column, row) / world.lattice.quantum)));
        }
    }
    return world;
}

double VolumeWorld::height(double x, double y) const {
    const double u = x / lattice.spacing, v = y / lattice.spacing;
    const int column = std::clamp(static_cast<int>(std::floor(u)), 0, columns - 2);
    const int row = std::clamp(static_cast<int>(std::floor(v)), 0, rows - 2);
    const double s = u - column, t = v - row;
    const double sw = sample(column, row), se = sample(column + 1, row);
    const double nw = sample(column, row + 1), ne = sample(column + 1, row + 1);
    if (cut_to_north_east(column, row)) {
        return s >= t ? sw + s * (se - sw) + t * (ne - se) : sw + t * (nw - sw) + s * (ne - nw);
    }
    return s + t <= 1.0 ? sw + s * (se - sw) + t * (nw - sw)
                        : ne + (1.0 - s) * (nw - ne) + (1.0 - t) * (se - ne);
}

std::array<double, 2> VolumeWorld::cell_range(double x, double y) const {
    const int column = std::clamp(static_cast<int>(x / lattice.spacing), 0, columns - 2);
    const int row = std::clamp(static_cast<int>(y / lattice.spacing), 0, rows - 2);
    const auto [low, high] = std::minmax({sample(column, row), sample(column + 1, row),
                                          sample(column, row + 1), sample(column + 1, row + 1)});
    return {low, high};
}

std::vector<std::int32_t> VolumeWorld::tile_heights(const VolumeTileKey& key) const {
    std::vector<std::int32_t> tile;
    for (int row = 0; row < kVolumeTileSamples; ++row) {
        for (int column = 0; column < kVolumeTileSamples; ++column) {
            const auto at = (key.row * kVolumeTileCells + row) * columns +
                            key.column * kVolumeTileCells + column;
            tile.push_back(heights[static_cast<std::size_t>(at)]);
        }
    }
    return tile;
}

std::vector<VolumeContour> contour_all(const VolumeWorld& world, const Volumes& volumes) {
    std::vector<VolumeContour> contours;
    for (const VolumeTileKey& key : volumes.tiles()) {
        const auto tile = VolumeTile::create(volumes, key, world.tile_heights(key));
        EXPECT_TRUE(tile.has_value()) << (tile ? "" : tile.error().message);
        if (tile) contours.push_back(tile->contour());
    }
    return contours;
}

JoinedMesh join(const VolumeWorld& world, const Volumes& volumes,
                const std::vector<VolumeContour>& contours) {
    JoinedMesh mesh;
    std::map<VolumeVertexKey, std::uint32_t> index;
    constexpr std::uint32_t kNone = ~0u;
    std::vector<std::uint32_t> samples(world.heights.size(), kNone);
    const auto find = [&](const VolumeVertexKey& key, const WorldPos& position) {
        const auto next = static_cast<std::uint32_t>(mesh.keys.size());
        const bool is_sample = key.is_node();
        std::uint32_t& found = is_sample ? samples[static_cast<std::size_t>(
                                               key.first.row * world.columns + key.first.column)]
                                         : index.try_emplace(key, kNone).first->second;
        if (found == kNone) {
            found = next;
            mesh.keys.push_back(key);
            mesh.positions.push_back(position);
        } else if (mesh.keys[found] != key || mesh.positions[found] != position) {
            mesh.fault = "tiles disagree about " + text(key);
        }
        return found;
    };
    std::vector<char> replaced(static_cast<std::size_t>(2 * (world.columns - 1) * (world.rows - 1)),
                               0);
    for (const VolumeContour& contour : contours) {
        std::vector<std::uint32_t> local;
        for (std::size_t i = 0; i < contour.keys.size(); ++i) {
            local.push_back(find(contour.keys[i], contour.positions_world[i]));
        }
        for (const auto& t : contour.triangles)
            mesh.triangles.push_back({local[t[0]], local[t[1]], local[t[2]]});
        for (const std::uint16_t name : contour.replaced) {
            const auto column = contour.key.column * kVolumeTileCells + name / 2 % kVolumeTileCells;
            const auto row = contour.key.row * kVolumeTileCells + name / 2 / kVolumeTileCells;
            replaced[static_cast<std::size_t>(2 * (row * (world.columns - 1) + column) +
                                              name % 2)] = 1;
        }
    }
    std::size_t triangle = 0;
    for (int row = 0; row + 1 < world.rows; ++row) {
        for (int column = 0; column + 1 < world.columns; ++column) {
            for (const auto& corners : cell_triangles(column, row)) {
                if (replaced[triangle++] != 0) continue;
                std::array<std::uint32_t, 3> t{};
                for (std::size_t i = 0; i < 3; ++i) {
                    const int c = column + corners[i][0], r = row + corners[i][1];
                    const double z = world.sample(c, r), s = volumes.spacing();
                    const VolumeNode node{c, r, static_cast<std::int32_t>(std::floor(z / s + 0.5))};
                    t[i] = find({node, node}, {world.lattice.x(c), world.lattice.y(r), z});
                }
                mesh.triangles.push_back(t);
            }
        }
    }
    return mesh;
}

std::string find_leak(const VolumeWorld& world, const JoinedMesh& mesh) {
    if (!mesh.fault.empty()) return mesh.fault;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (!mesh.positions[i].allFinite())
            return "a position of " + text(mesh.keys[i]) + " is not finite";
    }
    std::vector<std::uint64_t> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) {
            if (t[i] == t[(i + 1) % 3])
                return "a triangle has twice the vertex " + text(mesh.keys[t[i]]);
            edges.push_back(std::uint64_t{t[i]} << 32 | t[(i + 1) % 3]);
        }
    }
    std::ranges::sort(edges);
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto a = static_cast<std::uint32_t>(edges[i] >> 32),
                   b = static_cast<std::uint32_t>(edges[i]);
        if (i > 0 && edges[i] == edges[i - 1]) {
            return "two triangles on one side of " + text(mesh.keys[a]) + " - " +
                   text(mesh.keys[b]);
        }
        if (!std::ranges::binary_search(edges, std::uint64_t{b} << 32 | a) &&
            !on_one_border(world, mesh.keys[a], mesh.keys[b])) {
            return "one triangle at " + text(mesh.keys[a]) + " - " + text(mesh.keys[b]);
        }
    }
    return {};
}

double signed_volume(const JoinedMesh& mesh) {
    double volume = 0.0;
    for (const auto& t : mesh.triangles) {
        const WorldPos &a = mesh.positions[t[0]], &b = mesh.positions[t[1]],
                       &c = mesh.positions[t[2]];
        const double area =
            0.5 * ((b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y()));
        volume += area * (a.z() + b.z() + c.z()) / 3.0;
    }
    return volume;
}

VerticalCrossings::VerticalCrossings(const VolumeWorld& world, const JoinedMesh& mesh)
    : world_(world), mesh_(mesh) {
    bins_.resize(static_cast<std::size_t>((world.columns - 1) * (world.rows - 1)));
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        // A triangle lies over one cell.
        const auto& t = mesh.triangles[i];
        const WorldPos middle =
            (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
        bins_[bin(middle.x(), middle.y())].push_back(i);
    }
}

std::size_t VerticalCrossings::bin(double x, double y) const {
    const int column =
        std::clamp(static_cast<int>(x / world_.lattice.spacing), 0, world_.columns - 2);
    const int row = std::clamp(static_cast<int>(y / world_.lattice.spacing), 0, world_.rows - 2);
    return static_cast<std::size_t>(row * (world_.columns - 1) + column);
}

int VerticalCrossings::above(const Eigen::Vector3d& p_world) const {
    int count = 0;
    for (const std::uint32_t i : bins_[bin(p_world.x(), p_world.y())]) {
        const auto& t = mesh_.triangles[i];
        std::array<double, 3> area{};
        for (std::size_t j = 0; j < 3; ++j) {
            const WorldPos &a = mesh_.positions[t[(j + 1) % 3]],
                           &b = mesh_.positions[t[(j + 2) % 3]];
            area[j] = (a.x() - p_world.x()) * (b.y() - p_world.y()) -
                      (b.x() - p_world.x()) * (a.y() - p_world.y());
        }
        const bool up = area[0] > 0.0 && area[1] > 0.0 && area[2] > 0.0;
        const bool down = area[0] < 0.0 && area[1] < 0.0 && area[2] < 0.0;
        if (!up && !down) continue;
        double z = 0.0;
        for (std::size_t j = 0; j < 3; ++j) z += area[j] * mesh_.positions[t[j]].z();
        if (z / (area[0] + area[1] + area[2]) > p_world.z()) count += up ? 1 : -1;
    }
    return count;
}

FrameMesh::FrameMesh(const TerrainMesh& mesh) {
    std::map<std::array<double, 3>, std::uint32_t> numbers;
    const auto number_of = [&](const WorldPos& p) {
        const auto next = static_cast<std::uint32_t>(positions.size());
        const auto [found, is_new] = numbers.try_emplace({p.x(), p.y(), p.z()}, next);
        if (is_new) positions.push_back(p);
        return found->second;
    };
    if (mesh.resident == nullptr) return;
    const Lattice& lattice = mesh.resident->lattice();
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const auto sample = [&](std::uint16_t i) {
            return number_of({lattice.x(chunk.corner.x + i % kChunkSamples * chunk.step),
                              lattice.y(chunk.corner.y + i / kChunkSamples * chunk.step),
                              part.displayed_height(i, lattice.quantum)});
        };
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            const auto* corners = &mesh.indices[part.first_index + i];
            triangles.push_back({sample(corners[0]), sample(corners[1]), sample(corners[2])});
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        const auto& vertices = solid.chunk->solid->triangles().vertices_world;
        const auto add = [&](MeshSolid::Triangles of_part) {
            for (const auto& [a, b, c] : of_part) {
                triangles.push_back(
                    {number_of(vertices[a]), number_of(vertices[b]), number_of(vertices[c])});
            }
        };
        add(solid.triangles);
        for (const MeshSolid::Triangles& cap : solid.caps) add(cap);
    }
}

void FrameMesh::add_finest(const Lattice& lattice, const Chunk& chunk) {
    const auto add = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), {a, b, c});
        triangles.push_back({first, first + 1, first + 2});
    };
    const auto sample = [&](int column, int row) {
        return Eigen::Vector3d(lattice.x(chunk.corner.x + column * chunk.step),
                               lattice.y(chunk.corner.y + row * chunk.step),
                               lattice.quantum * chunk.heights[sample_index(column, row)]);
    };
    for (int row = 0; row < kChunkCells; ++row) {
        for (int i = 0; i < kChunkCells; ++i) {
            const bool cut = cut_to_north_east(i, row);  // corners of chunks are even
            const std::size_t cell = cell_index(i, row);
            if (!chunk.solid || !chunk.solid->is_replaced(cell, false))
                add(sample(i, row), sample(i + 1, row), sample(cut ? i + 1 : i, row + 1));
            if (!chunk.solid || !chunk.solid->is_replaced(cell, true))
                add(sample(i, row + 1), sample(cut ? i : i + 1, row), sample(i + 1, row + 1));
        }
    }
    if (!chunk.solid) return;
    const SolidTriangles& solid = chunk.solid->triangles();
    for (const auto& [a, b, c] : solid.triangles)
        add(solid.vertices_world[a], solid.vertices_world[b], solid.vertices_world[c]);
}

std::string FrameMesh::find_flaw(const TerrainMesh& mesh) const {
    std::ostringstream out;
    if (triangles.size() != mesh.triangle_count) {
        out << triangles.size() << " triangles, the mesh says " << mesh.triangle_count;
        return out.str();
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(3 * triangles.size());
    for (const auto& [a, b, c] : triangles) {
        if (a == b || b == c || c == a) return "a triangle has two equal vertices";
        edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
    }
    std::ranges::sort(edges);
    const Lattice& lattice = mesh.resident->lattice();
    const double west = lattice.x(lattice.west()), east = lattice.x(lattice.east());
    const double south = lattice.y(lattice.south()), north = lattice.y(lattice.north());
    const auto place = [&](std::uint32_t v) {
        out << "(" << positions[v].x() << ", " << positions[v].y() << ", " << positions[v].z()
            << ")";
    };
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto [a, b] = edges[i];
        const bool is_double = i + 1 < edges.size() && edges[i + 1] == edges[i];
        const bool has_opposite = std::ranges::binary_search(edges, std::pair(b, a));
        if (!is_double && has_opposite) continue;
        const WorldPos &p = positions[a], &q = positions[b];
        const bool is_border =
            (p.x() == west && q.x() == west) || (p.x() == east && q.x() == east) ||
            (p.y() == south && q.y() == south) || (p.y() == north && q.y() == north);
        if (is_border && !is_double) continue;
        out << (is_double ? "two triangles on one side of the edge " : "an open edge ");
        place(a);
        out << " to ";
        place(b);
        return out.str();
    }
    return "";
}

FrameMesh::Nearest FrameMesh::nearest(const Eigen::Vector3d& p_world) const {
    Nearest found;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& [a, b, c] = triangles[i];
        const WorldPos &p = positions[a], &q = positions[b], &r = positions[c];
        const Eigen::Vector3d low = p.cwiseMin(q).cwiseMin(r), high = p.cwiseMax(q).cwiseMax(r);
        const Eigen::Vector3d outside =
            (low - p_world).cwiseMax(p_world - high).cwiseMax(Eigen::Vector3d::Zero());
        if (outside.squaredNorm() >= found.distance * found.distance) continue;
        const double distance = distance_to_triangle(p_world, p, q, r);
        if (distance < found.distance) found = {distance, i};
    }
    return found;
}

}  // namespace terrane::test
