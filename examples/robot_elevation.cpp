// An elevation map, in the layout of ROS's grid_map, that follows a robot over the ground. Prints what a grid_map_msgs
// message of the map contains.
#include "motion_trace.h"

#include <terrane/adapters/elevation_map.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main(int argc, char** argv) {
    using namespace terrane;
    MotionTrace trace(argc, argv);
    const auto source = FractalHeights::create({.seed = 7, .finest_spacing_log2 = -2}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    adapters::ElevationMap map =
        adapters::ElevationMap::create({.length_x = 6.0, .length_y = 6.0, .resolution = 0.1})
            .value();
    std::int64_t read = 0, absent = 0;
    for (int step = 0; step < 300; ++step) {
        const double x = 0.02 * step, y = 0.01 * step;
        const BodyNeed need{.centre_world = {x, y, source->height(x, y)}, .radius = 6.0};
        const Frame& frame = terrain.update({}, {&need, 1}, step * 0.02);
        const adapters::ElevationMapUpdate update = map.update(frame.ground, x, y);
        read += update.read_cells;
        absent += update.absent_cells;
        const auto [lowest, highest] = std::minmax_element(map.layer().begin(), map.layer().end());
        const double z = source->height(x, y);
        trace.add("lowest cell", step * 0.02, {x, y, static_cast<double>(*lowest)}, z);
        trace.add("highest cell", step * 0.02, {x, y, static_cast<double>(*highest)}, z);
    }
    // info.resolution, info.length_*, info.pose.position, outer_start_index, inner_start_index, data[0].data
    std::printf("%lld x %lld cells of %.2f m around (%.1f, %.1f), start index (%lld, %lld)\n",
                static_cast<long long>(map.rows()), static_cast<long long>(map.columns()),
                map.resolution(), map.position_x(), map.position_y(),
                static_cast<long long>(map.start_row()),
                static_cast<long long>(map.start_column()));
    const auto [low, high] = std::minmax_element(map.layer().begin(), map.layer().end());
    std::printf("heights %.2f to %.2f m; %lld cells read in 300 updates, %lld absent\n",
                static_cast<double>(*low), static_cast<double>(*high), static_cast<long long>(read),
                static_cast<long long>(absent));
    return absent == 0 ? 0 : 1;
}
