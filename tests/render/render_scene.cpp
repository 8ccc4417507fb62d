// SPDX-License-Identifier: MIT
#include "render/render_scene.h"

#include "support/grounds.h"

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/primitive_meshes.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace terrane::test {
namespace {

constexpr double kWavelength = 90.0;

// Heights and bounds that are made from those of waves.
class OverWaves : public ForwardedHeights {
public:
    OverWaves(const Lattice& lattice, double amplitude)
        : ForwardedHeights(std::make_shared<const WaveHeights>(lattice, amplitude, kWavelength)) {}
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                heights_out[i++] = height(lattice().x(grid.corner.x + column * grid.step),
                                          lattice().y(grid.corner.y + row * grid.step));
            }
        }
        return {};
    }
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        // the base class computes bounds from the heights of this source
        return HeightSource::mesh_bounds(  // NOLINT(bugprone-parent-virtual-call)
            grid, vertex_bounds_out, cell_bounds_out);
    }
};

// Waves that move with the world: the same hills at any position of it.
class MovedHeights final : public OverWaves {
public:
    explicit MovedHeights(const Lattice& lattice) : OverWaves(lattice, 12.0) {}
    double height(double x, double y) const override {
        return heights().height(x - lattice().x(lattice().west()), y);
    }
};

// Gentle hills with a roughness at whole metres that is 0 where both coordinates are even, so that samples 2 m apart
// miss it.
class RoughHeights final : public OverWaves {
public:
    explicit RoughHeights(const Lattice& lattice) : OverWaves(lattice, 2.0) {}
    double height(double x, double y) const override {
        const auto column = static_cast<std::uint32_t>(std::lround(x));
        const auto row = static_cast<std::uint32_t>(std::lround(y));
        if ((column | row) % 2 == 0) return heights().height(x, y);
        std::uint32_t hash = column * 0x9e3779b1u ^ row * 0x85ebca77u;
        hash = (hash ^ (hash >> 15)) * 0x2c1b3c6du;
        hash ^= hash >> 13;
        return heights().height(x, y) +
               kRoughness * (static_cast<double>(hash) / 2147483647.5 - 1.0);
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return rougher(heights().vertex_bounds(grid, bounds_out), bounds_out);
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return rougher(heights().cell_bounds(grid, bounds_out), bounds_out);
    }
    HeightInterval interval(const WorldRect&) const override { return {-3.0, 3.0}; }
    double rise_bound(double distance) const override {
        return heights().rise_bound(distance) + 2.0 * kRoughness;
    }

private:
    static constexpr double kRoughness = 0.8;
    static Result<void> rougher(const Result<void>& made, std::span<float> bounds) {
        for (float& bound : bounds) bound += static_cast<float>(2.0 * kRoughness);
        return made;
    }
};

std::vector<std::shared_ptr<const Chunk>> make_chunks(const HeightSource& source,
                                                      std::span<const ChunkKey> keys) {
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const ChunkKey& key : keys) chunks.push_back(make_chunk(source, key).value());
    return chunks;
}

void add_triangle(Scene& scene, std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t i : {a, b, c}) scene.indices.push_back(static_cast<std::uint16_t>(i));
}

// A square of 2 x 2 cells: eight triangles around its centre, or fewer where an edge is on the border of the chunk, so
// that only every second border sample is a vertex.
void add_fan(Scene& scene, int column, int row) {
    const std::size_t middle = sample_index(column + 1, row + 1);
    const auto add_edge = [&](int x0, int y0, int x1, int y1, bool is_border) {
        const std::size_t first = sample_index(column + x0, row + y0);
        const std::size_t last = sample_index(column + x1, row + y1);
        const std::size_t between = sample_index(column + (x0 + x1) / 2, row + (y0 + y1) / 2);
        if (is_border) {
            add_triangle(scene, first, last, middle);
        } else {
            add_triangle(scene, first, between, middle);
            add_triangle(scene, between, last, middle);
        }
    };
    add_edge(0, 0, 2, 0, row == 0);
    add_edge(2, 0, 2, 2, column + 2 == kChunkCells);
    add_edge(2, 2, 0, 2, row + 2 == kChunkCells);
    add_edge(0, 2, 0, 0, column == 0);
}

void add_cell(Scene& scene, int column, int row) {
    const std::size_t south_west = sample_index(column, row);
    const std::size_t south_east = sample_index(column + 1, row);
    const std::size_t north_west = sample_index(column, row + 1);
    const std::size_t north_east = sample_index(column + 1, row + 1);
    if (cut_to_north_east(column, row)) {
        add_triangle(scene, south_west, south_east, north_east);
        add_triangle(scene, south_west, north_east, north_west);
    } else {
        add_triangle(scene, south_west, south_east, north_west);
        add_triangle(scene, south_east, north_east, north_west);
    }
}

// Adds a chunk; add(column, row) adds triangles of its cells, each `step`th along both axes.
template <class Add>
void add_chunk(Scene& scene, const Chunk& chunk, int step, const Add& add) {
    const auto first = static_cast<std::uint32_t>(scene.indices.size());
    for (int row = 0; row < kChunkCells; row += step) {
        for (int column = 0; column < kChunkCells; column += step) add(column, row);
    }
    const auto count = static_cast<std::uint32_t>(scene.indices.size()) - first;
    scene.chunks.push_back({&chunk, first, count, nullptr});
}

// Two roots of 256 m.
Lattice two_roots(int finest_level, std::int32_t roots_east = 0) {
    Lattice lattice{.spacing = finest_level == 0 ? 2.0 : 1.0, .finest_level = finest_level};
    lattice.first_root_x = roots_east;
    lattice.root_count_x = 2;
    return lattice;
}

}  // namespace

TerrainMesh Scene::mesh() const {
    TerrainMesh mesh;
    mesh.resident = resident;
    mesh.chunks = chunks;
    mesh.indices = indices;
    mesh.triangle_count = indices.size() / 3;
    mesh.status = MeshStatus::error_met;
    return mesh;
}

double Scene::height(double x, double y) const {
    return MovedHeights(resident->lattice()).height(x, y);
}

Scene make_scene(std::int32_t roots_east) {
    const MovedHeights source(two_roots(1, roots_east));
    const ChunkKey keys[] = {
        {roots_east, 0, 0}, {roots_east + 1, 0, 0}, {2 * roots_east + 1, 1, 1}};
    const auto chunks = make_chunks(source, keys);
    Scene scene;
    add_chunk(scene, *chunks[0], 1, [&](int column, int row) {
        if (column < kChunkCells / 2 || row < kChunkCells / 2) add_cell(scene, column, row);
    });
    add_chunk(scene, *chunks[1], 1, [&](int column, int row) { add_cell(scene, column, row); });
    add_chunk(scene, *chunks[2], 2, [&](int column, int row) { add_fan(scene, column, row); });
    scene.resident =
        std::make_shared<const ResidentSet>(source.lattice(), source.extent(), chunks, 1);
    return scene;
}

Scene make_rough_scene(std::span<const ChunkKey> resident, std::span<const ChunkKey> drawn) {
    const RoughHeights source(two_roots(1));
    std::vector<ChunkKey> keys{{0, 0, 0}, {1, 0, 0}};
    keys.insert(keys.end(), resident.begin(), resident.end());
    const auto chunks = make_chunks(source, keys);
    const auto is_drawn = [&](const ChunkKey& key) {
        return std::find(drawn.begin(), drawn.end(), key) != drawn.end();
    };
    Scene scene;
    for (const std::shared_ptr<const Chunk>& chunk : chunks) {
        if (chunk->key.level == 1 && !is_drawn(chunk->key)) continue;
        add_chunk(scene, *chunk, 1, [&](int column, int row) {
            const int quadrant = column / (kChunkCells / 2) + 2 * (row / (kChunkCells / 2));
            if (chunk->key.level == 0 && is_drawn(chunk->key.child(quadrant))) return;
            add_cell(scene, column, row);
        });
    }
    scene.resident =
        std::make_shared<const ResidentSet>(source.lattice(), source.extent(), chunks, 1);
    return scene;
}

float offset_at(std::int64_t x, std::int64_t y) {
    if (x > 250) return 0.0f;
    // multiples of 1/48, so that sums are rounded
    return static_cast<float>((x * 37 + y * 101) % 64 - 32) / 48.0f;
}

void add_offsets(Scene& scene) {
    const Lattice& lattice = scene.resident->lattice();
    scene.offsets.clear();
    scene.offsets.reserve(scene.chunks.size());
    for (MeshChunk& drawn : scene.chunks) {
        const Chunk& chunk = *drawn.chunk;
        if (chunk.key.level == 0 && chunk.key.x != lattice.first_root_x) continue;
        std::vector<float>& offsets = scene.offsets.emplace_back(
            std::size_t{kChunkSamples} * kChunkSamples, std::numeric_limits<float>::quiet_NaN());
        for (std::uint32_t i = 0; i < drawn.index_count; ++i) {
            const std::uint16_t sample = scene.indices[drawn.first_index + i];
            const std::int64_t x = chunk.corner.x + sample % kChunkSamples * chunk.step;
            const std::int64_t y = chunk.corner.y + sample / kChunkSamples * chunk.step;
            offsets[sample] = offset_at(x - lattice.west(), y - lattice.south());
        }
        drawn.offsets = offsets.data();
    }
}

Image draw(TerrainRenderer& renderer, const View& view, const SceneDraws& draws,
           const TerrainMesh& mesh) {
    const Result<void> drawn = renderer.draw(mesh, view, draws);
    EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
    Image image = renderer.read();
    if (const char* folder = std::getenv("TERRANE_PICTURES"); folder != nullptr) {
        static int count = 0;
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        EXPECT_TRUE(write_png(image, std::string(folder) + "/" + info->name() + "_" +
                                         std::to_string(count++) + ".png"));
    }
    return image;
}

namespace {

TriangleMesh mesh_of(const Solid& solid) {
    TriangleMesh mesh;
    if (solid.form == Solid::Form::box) {
        mesh = make_box_mesh(solid.extents).value();
    } else {
        mesh = (solid.form == Solid::Form::ellipsoid ? make_sphere_mesh(1.0)
                                                     : make_cylinder_mesh(1.0, 1.0))
                   .value();
        for (Eigen::Vector3d& p : mesh.positions) p = p.cwiseProduct(solid.extents);
    }
    const auto byte = [](float part) { return static_cast<std::uint8_t>(255.0f * part + 0.5f); };
    mesh.colours.assign(mesh.positions.size(), {byte(solid.colour.red), byte(solid.colour.green),
                                                byte(solid.colour.blue), 255});
    return mesh;
}

}  // namespace

Image draw(TerrainRenderer& renderer, const TerrainMesh& mesh, const View& view,
           std::span<const Solid> solids) {
    std::vector<ObjectInstance> instances;
    std::vector<MeshDraw> draws;
    for (const Solid& solid : solids) {
        const Pose& pose = solid.world_from_solid;
        const Eigen::Quaternionf q(pose.rotation.cast<float>());
        ObjectInstance instance = instance_at(view, pose.translation);
        instance.rotation = {q.x(), q.y(), q.z(), q.w()};
        const Result<MeshId> added = renderer.add_mesh(mesh_of(solid));
        EXPECT_TRUE(added) << (added ? "" : added.error().message);
        if (!added) continue;
        draws.push_back({.mesh = *added,
                         .first_instance = static_cast<std::uint32_t>(instances.size()),
                         .instance_count = 1});
        instances.push_back(instance);
    }
    const Image image = draw(renderer, view, {.instances = instances, .meshes = draws}, mesh);
    for (const MeshDraw& each : draws) renderer.remove_mesh(each.mesh);
    return image;
}

ObjectInstance instance_at(const View& view, const WorldPos& place) {
    const LocalVec offset = to_local(place, view.eye_world);
    return {.offset_eye = {offset.x(), offset.y(), offset.z()}};
}

int count_different(const Image& a, const Image& b, int more_than) {
    if (a.rgb.size() != b.rgb.size()) return -1;
    int count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        bool is_different = false;
        for (std::size_t c = i; c < i + 3; ++c) {
            is_different = is_different || std::abs(int{a.rgb[c]} - int{b.rgb[c]}) > more_than;
        }
        count += is_different ? 1 : 0;
    }
    return count;
}

int largest_difference(const Image& a, const Image& b) {
    if (a.rgb.size() != b.rgb.size()) return 256;
    int largest = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) {
        largest = std::max(largest, std::abs(int{a.rgb[i]} - int{b.rgb[i]}));
    }
    return largest;
}

Scene make_plane_scene(double height, double slope_east, double spacing, std::int32_t roots_east) {
    Lattice lattice = two_roots(0, roots_east);
    lattice.spacing = spacing;
    const double middle = lattice.x(lattice.west()) + kChunkCells * spacing;
    const WaveHeights source(lattice, 1.0, kWavelength);
    std::vector<std::shared_ptr<const Chunk>> chunks;
    Scene scene;
    for (std::int32_t root = 0; root < 2; ++root) {
        auto chunk =
            std::make_shared<Chunk>(*make_chunk(source, {roots_east + root, 0, 0}).value());
        for (int row = 0; row < kChunkSamples; ++row) {
            for (int column = 0; column < kChunkSamples; ++column) {
                const double x = lattice.x(chunk->corner.x + column * chunk->step);
                chunk->heights[sample_index(column, row)] = static_cast<std::int32_t>(
                    std::lround((height + slope_east * (x - middle)) / lattice.quantum));
            }
        }
        const auto [low, high] = std::ranges::minmax(chunk->heights);
        chunk->low = low;
        chunk->high = high;
        chunks.push_back(chunk);
        add_chunk(scene, *chunk, 1, [&](int column, int row) { add_cell(scene, column, row); });
    }
    scene.resident = std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, 1);
    return scene;
}

void raise_western_root(Scene& scene, float by) {
    scene.offsets.emplace_back(std::size_t{kChunkSamples} * kChunkSamples, by);
    scene.chunks[0].offsets = scene.offsets.back().data();
}

}  // namespace terrane::test
