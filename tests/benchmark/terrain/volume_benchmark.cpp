// SPDX-License-Identifier: MIT
//
// Time, memory and accuracy of volumes. Prints one line a figure; --quick repeats less often.
#include "benchmark/bench.h"
#include "support/random.h"
#include "volume/joined_mesh.h"
#include "volume/volume_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace terrane {
namespace {

using namespace test;

double milliseconds(const std::function<void()>& work, int repetitions) {
    return tools::median_ms(repetitions, tools::Clock::wall, work);
}

VolumeWorld rough_world(double spacing) {
    Random random(7);
    return VolumeWorld::make(2, spacing, [&](int column, int row) {
        return 30.0 * spacing + 4.0 * spacing * std::sin(column * 0.1) * std::sin(row * 0.07) +
               spacing * random.between(0.0, 1.0);
    });
}

VolumeOperation remove(VolumeShape shape, const Eigen::Vector3d& at, double voxel) {
    VolumeOperation operation{.op = VolumeOp::remove, .shape = std::move(shape), .voxel = voxel};
    operation.world_from_shape.translation = at;
    return operation;
}

void measure_dig(int repetitions) {
    const double s = 0.25;
    const VolumeWorld world = rough_world(s);
    const std::vector<VolumeOperation> cave = {remove(VolumeSphere{5.0}, {32.4, 16.3, 6.0}, s)};
    const Volumes volumes = Volumes::create(world.lattice, cave).value();
    std::vector<VolumeTile> tiles;
    double build = 0.0, contour = 0.0;
    std::uint64_t nodes = 0, layers = 0;
    std::size_t triangles = 0;
    build = milliseconds(
        [&] {
            tiles.clear();
            for (const VolumeTileKey& key : volumes.tiles()) {
                tiles.push_back(VolumeTile::create(volumes, key, world.tile_heights(key)).value());
            }
        },
        repetitions);
    contour = milliseconds(
        [&] {
            triangles = 0;
            layers = 0;
            for (const VolumeTile& tile : tiles) {
                const VolumeContour surface = tile.contour();
                triangles += surface.triangles.size();
                layers += surface.layer_count;
            }
        },
        repetitions);
    for (const VolumeTile& tile : tiles) nodes += tile.band_node_count();
    std::printf(
        "sphere of 5 m at 0.25 m, %zu tiles: level sets %.2f ms (%.1f ns a band node of %llu), "
        "contour %.2f ms, "
        "%zu triangles, %llu layers\n",
        tiles.size(), build, 1e6 * build / static_cast<double>(nodes),
        static_cast<unsigned long long>(nodes), contour, triangles,
        static_cast<unsigned long long>(layers));
    // Ten thousand digs in one place: what the last hundred cost.
    Random random(3);
    for (const int before : {0, 1000, 10000}) {
        for (int i = before == 0 ? 0 : before / 10; i < before; ++i) {
            const Eigen::Vector3d at(32.4 + random.between(-3.0, 3.0),
                                     16.3 + random.between(-3.0, 3.0),
                                     7.0 + random.between(-3.0, 3.0));
            const auto dig =
                PlacedVolume::create(world.lattice, 0, remove(VolumeSphere{1.0}, at, s)).value();
            for (VolumeTile& tile : tiles) tile.apply(dig);
        }
        const auto dig = PlacedVolume::create(world.lattice, 0, cave[0]).value();
        const double apply = milliseconds(
            [&] {
                for (VolumeTile& tile : tiles) tile.apply(dig);
            },
            repetitions);
        const double remesh = milliseconds(
            [&] {
                for (VolumeTile& tile : tiles) (void)tile.contour();
            },
            repetitions);
        std::printf("dig of 5 m after %d others: level sets %.2f ms, contour %.2f ms\n", before,
                    apply, remesh);
    }
}

void measure_memory() {
    const double s = 0.5;
    for (const bool straight : {true, false}) {
        for (const double length : {50.0, 100.0, 200.0}) {
            VolumeWorld world = VolumeWorld::make(4, s, [](int, int) { return 60.0; });
            VolumeTube tube{
                .path_shape = {{0, 0, 0}, {length, straight ? 0.0 : 25.0 * length / 200.0, 0}},
                .radius = 5.0};
            const std::vector<VolumeOperation> list = {remove(tube, {20.3, 20.1, 30.2}, s)};
            const Volumes volumes = Volumes::create(world.lattice, list).value();
            std::size_t bytes = 0;
            std::uint64_t nodes = 0;
            for (const VolumeTileKey& key : volumes.tiles()) {
                const auto tile = VolumeTile::create(volumes, key, world.tile_heights(key)).value();
                bytes += tile.bytes();
                nodes += tile.band_node_count();
            }
            // The band: between 3 voxels inside and 3 outside of the capsule.
            const double r = 5.0 / s, l = tube.path_shape[1].norm() / s, pi = 3.14159265358979;
            const double band = pi * l * (std::pow(r + 3.0, 2) - std::pow(r - 3.0, 2)) +
                                4.0 / 3.0 * pi * (std::pow(r + 3.0, 3) - std::pow(r - 3.0, 3));
            std::printf(
                "tunnel of %.0f m, radius 5 m, at 0.5 m, %s: %.0f KB, %.2f times 4 bytes a voxel "
                "of its band "
                "(%.0f; in tiles %llu)\n",
                length, straight ? "along tiles" : "across", static_cast<double>(bytes) / 1e3,
                static_cast<double>(bytes) / (4.0 * band), band,
                static_cast<unsigned long long>(nodes));
        }
    }
}

struct Accuracy {
    double vertex_mean = 0.0, vertex_worst = 0.0, inside_mean = 0.0, inside_worst = 0.0;
    long vertices = 0, points = 0;
};

// Distances in spacings, of vertices and of points inside triangles; where `counts` says so.
Accuracy measure(const VolumeWorld& world, const VolumeOperation& operation,
                 const std::function<bool(const Eigen::Vector3d&)>& counts) {
    const std::vector<VolumeOperation> list = {operation};
    const Volumes volumes = Volumes::create(world.lattice, list).value();
    const double s = volumes.spacing();
    Accuracy accuracy;
    Random random(1);
    for (const VolumeContour& contour : contour_all(world, volumes)) {
        for (std::size_t i = 0; i < contour.keys.size(); ++i) {
            if (contour.keys[i].is_node() || !counts(contour.positions_world[i])) continue;
            const double off =
                std::abs(AnalyticSolid::distance(operation, contour.positions_world[i])) / s;
            accuracy.vertex_mean += off;
            accuracy.vertex_worst = std::max(accuracy.vertex_worst, off);
            ++accuracy.vertices;
        }
        for (const auto& t : contour.triangles) {
            for (int i = 0; i < 16; ++i) {
                double u = random.between(0.0, 1.0), v = random.between(0.0, 1.0);
                if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
                const auto& p = contour.positions_world;
                const Eigen::Vector3d at =
                    p[t[0]] + u * (p[t[1]] - p[t[0]]) + v * (p[t[2]] - p[t[0]]);
                if (!counts(at)) continue;
                const double off = std::abs(AnalyticSolid::distance(operation, at)) / s;
                accuracy.inside_mean += off;
                accuracy.inside_worst = std::max(accuracy.inside_worst, off);
                ++accuracy.points;
            }
        }
    }
    accuracy.vertex_mean /= static_cast<double>(accuracy.vertices);
    accuracy.inside_mean /= static_cast<double>(accuracy.points);
    return accuracy;
}

void print(const char* what, const Accuracy& a) {
    std::printf(
        "%s, voxels: vertices mean %.4f worst %.4f, inside triangles mean %.4f worst %.4f (%ld, "
        "%ld)\n",
        what, a.vertex_mean, a.vertex_worst, a.inside_mean, a.inside_worst, a.vertices, a.points);
}

void measure_accuracy() {
    const auto always = [](const Eigen::Vector3d&) { return true; };
    for (const bool rough : {false, true}) {
        const VolumeWorld world =
            rough ? rough_world(1.0) : VolumeWorld::make(2, 1.0, [](int, int) { return 30.0; });
        const auto sphere = remove(VolumeSphere{20.0}, {64.3, 64.1, -5.4}, 1.0);
        print(rough ? "sphere of 20 voxels, rough ground" : "sphere of 20 voxels, flat ground",
              measure(world, sphere, always));
        auto box = remove(VolumeBox{{16.0, 12.0, 10.0}}, {64.3, 64.1, -5.4}, 1.0);
        Random random(11);
        box.world_from_shape.rotation = random.rotation();
        const auto from_edges = [&](double least, double most) {
            return [box, least, most](const Eigen::Vector3d& p) {
                const Eigen::Vector3d q = box.world_from_shape.rotation.transpose() *
                                          (p - box.world_from_shape.translation);
                Eigen::Array3d gap =
                    (std::get<VolumeBox>(box.shape).half_extents.array() - q.array().abs()).abs();
                std::sort(gap.begin(), gap.end());
                return gap[1] >= least && gap[1] <= most;
            };
        };
        print("box, two voxels and more from its edges", measure(world, box, from_edges(2.0, 1e9)));
        print("box, nearer to its edges", measure(world, box, from_edges(0.0, 2.0)));
    }
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
    terrane::bench::Arguments arguments(argc, argv, "volume_benchmark [--quick]");
    const bool quick = arguments.has("--quick");
    arguments.finish();
    terrane::measure_dig(quick ? 1 : 15);
    terrane::measure_memory();
    terrane::measure_accuracy();
}
