// SPDX-License-Identifier: MIT
//
// Hulls, volume, distances and time of collision proxies, by mesh and error. --quick: one error and few samples.
#include "benchmark/bench.h"
#include "collision/shapes/proxy_meshes.h"

#include <terrane/collision/collision_proxy.h>

#include <cstdio>
#include <vector>

int main(int argc, char** argv) {
    using namespace terrane;
    bench::Arguments arguments(argc, argv, "proxy_benchmark [--quick]");
    const bool is_quick = arguments.has("--quick");
    arguments.finish();
    std::vector<test::NamedMesh> meshes = test::proxy_meshes();
    if (is_quick) meshes.resize(3);
    std::printf("%-12s %9s %9s %6s %9s %12s %12s %9s\n", "mesh", "triangles", "error", "parts",
                "volume", "certified m", "measured m", "ms");
    for (const auto& [name, mesh] : meshes) {
        Eigen::Vector3d low = mesh.positions[0], high = low;
        for (const Eigen::Vector3d& p : mesh.positions) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
        const double extent = (high - low).maxCoeff();
        for (const double share : {0.0, 0.01, 0.02, 0.05, 0.1, 0.5}) {
            if (is_quick && share != 0.05) continue;
            const tools::Stopwatch watch(tools::Clock::wall);
            const Result<CollisionProxy> proxy =
                make_collision_proxy(mesh, {.proxy_error = share * extent});
            const double ms = watch.ms();
            if (!proxy) {
                std::printf("%s: %s\n", name.c_str(), proxy.error().message.c_str());
                return 1;
            }
            const test::ProxyDistance measured =
                test::measure_proxy(mesh, *proxy, is_quick ? 2000 : 20000, 1);
            std::printf("%-12s %9zu %9.4g %6zu %9.4g %12.6g %12.6g %9.1f %s\n", name.c_str(),
                        mesh.triangles.size(), share * extent, proxy->shape.parts().size(),
                        proxy->mesh_volume > 0.0 ? proxy->parts_volume / proxy->mesh_volume : 0.0,
                        proxy->distance_m, std::max(measured.mesh_to_proxy, measured.proxy_to_mesh),
                        ms, proxy->is_within_error ? "" : "limit");
            std::fflush(stdout);
        }
    }
    return 0;
}
