// SPDX-License-Identifier: MIT
#include "flight/path_ground.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

constexpr double kMostSteps = 20'000.0;

// Distance of a point from a rectangle; 0 inside.
double distance_beyond(const WorldRect& rect, const Eigen::Vector2d& p) {
    const double x = std::max({0.0, rect.west - p.x(), p.x() - rect.east});
    const double y = std::max({0.0, rect.south - p.y(), p.y() - rect.north});
    return std::hypot(x, y);
}

double length_of(const std::vector<Eigen::Vector2d>& line) {
    double length = 0.0;
    for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
    return length;
}

}  // namespace

Result<PathGround> find_ground_under(std::span<const std::vector<Eigen::Vector2d>> lines,
                                     const Terrain& terrain) {
    const std::shared_ptr<const HeightSource> source = heightfield_of(terrain);
    double whole = 0.0;
    for (const std::vector<Eigen::Vector2d>& line : lines) whole += length_of(line);
    const double step = std::max(source->lattice().spacing, whole / kMostSteps);
    PathGround ground;
    const auto visit = [&](const Eigen::Vector2d& p, double length) -> Result<void> {
        TERRANE_TRY(const bool is_ground, is_over_ground(*source, p.x(), p.y()));
        ground.length += length;
        if (is_ground) return {};
        ground.off_ground += length;
        if (!ground.is_complete()) return {};
        ground.first_along = ground.length;
        ground.first_world = p;
        ground.first_beyond = distance_beyond(source->extent(), p);
        return {};
    };
    for (const std::vector<Eigen::Vector2d>& line : lines) {
        TERRANE_TRY(visit(line.front(), 0.0));
        for (std::size_t i = 1; i < line.size(); ++i) {
            const Eigen::Vector2d segment = line[i] - line[i - 1];
            const double count = std::max(1.0, std::ceil(segment.norm() / step));
            for (double j = 1.0; j <= count; ++j) {
                TERRANE_TRY(visit(line[i - 1] + segment * (j / count), segment.norm() / count));
            }
        }
    }
    return ground;
}

std::vector<std::vector<Eigen::Vector2d>> lines_of(const CameraPath& path) {
    constexpr double kFinest = 0.05;  // seconds
    const double step = std::max(kFinest, path.duration() / kMostSteps);
    std::vector<std::vector<Eigen::Vector2d>> lines;
    double start = 0.0;
    for (std::size_t leg = 0; leg <= path.jumps().size(); ++leg) {
        const double end = leg < path.jumps().size() ? path.jumps()[leg] : path.duration();
        std::vector<Eigen::Vector2d> line;
        for (double time = start; time < end; time += step) {
            line.emplace_back(path.at(time).eye_world.head<2>());
        }
        line.emplace_back(path.before(end).eye_world.head<2>());
        lines.push_back(std::move(line));
        start = end;
    }
    return lines;
}

std::string describe_lack(const PathGround& ground, const Terrain& terrain) {
    constexpr double kLeastBeyond = 0.001;  // metres that are worth a word
    const WorldRect& extent = heightfield_of(terrain)->extent();
    const Eigen::Vector2d p = ground.first_world;
    std::string text = ground.first_along > 0.0
                           ? fmt::format("leaves the ground after {:.6g} of its {:.6g} m",
                                         ground.first_along, ground.length)
                           : std::string("starts where there is no ground");
    text += fmt::format(", at x {:.9g} m, y {:.9g} m", p.x(), p.y());
    if (ground.first_beyond >= kLeastBeyond) {
        text += fmt::format(
            ", {:.6g} m from the terrain, which is x {:.6g} to {:.6g} m and y {:.6g} to {:.6g} m",
            ground.first_beyond, extent.west, extent.east, extent.south, extent.north);
    }
    if (!terrain.dem || ground.first_beyond == 0.0) return text;
    // A path in the units of the raster's CRS
    const DemInfo& dem = *terrain.dem;
    const Result<Georeference> georeference = georeference_of(terrain);
    const WorldPos p_world = georeference
                                 ? georeference->world_from_crs({p.x(), p.y(), 0.0})
                                 : WorldPos((p.x() - dem.centre_x) * dem.metres_per_unit_x,
                                            (p.y() - dem.centre_y) * dem.metres_per_unit_y, 0.0);
    if (extent.contains(p_world.x(), p_world.y())) {
        text += fmt::format(
            "; x and y are metres from the raster's centre, which is {:.9g}, {:.9g} in its CRS",
            dem.centre_x, dem.centre_y);
    }
    return text;
}

}  // namespace terrane::tools
