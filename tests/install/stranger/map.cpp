// SPDX-License-Identifier: MIT
// Keeps an elevation map around a place; all of it must be ground.
#include <terrane/adapters/elevation_map.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <cstdio>

int main() {
    using namespace terrane;
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const RequiredRegion region =
        pager.require({.west = 50, .south = 150, .east = 150, .north = 250}, 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    adapters::ElevationMapSettings settings;
    settings.resolution = 0.5;
    settings.length_x = settings.length_y = 20.0;
    auto map = adapters::ElevationMap::create(settings);
    if (!map) {
        std::printf("%s\n", map.error().message.c_str());
        return 1;
    }
    const Ground ground = pager.ground();
    const auto update = map->update(ground, 100.0, 200.0);
    std::printf("%td cells, %td of them absent\n", static_cast<std::ptrdiff_t>(update.read_cells),
                static_cast<std::ptrdiff_t>(update.absent_cells));
    return update.read_cells > 0 && update.absent_cells == 0 ? 0 : 1;
}
