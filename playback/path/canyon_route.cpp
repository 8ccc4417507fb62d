// SPDX-License-Identifier: MIT
// Sources: E. W. Dijkstra. A note on two problems in connexion with graphs. 1959.
//          A. Weiss. Topographic position and landforms analysis. ESRI user conference 2001: ground
//          is a valley where it is below the mean of its surroundings.
#include "path/canyon_route.h"

#include "track/curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>

namespace terrane::internal {
namespace {

constexpr int kNodes = 192;            // nodes along a side of the search grid
constexpr int kWindows = 5;            // candidate positions of the grid along a side
constexpr int kProbes = 12;            // heights along a side that roughness is measured with
constexpr double kLeastSide = 6000.0;  // metres: smaller squares hardly hold a valley
constexpr double kCheapest = 0.03;     // cost of a valley floor relative to a ridge: limits detours

struct Grid {
    double west = 0.0, south = 0.0, spacing = 1.0;
    std::vector<double> value;  // [kNodes^2] from the south-west
};

std::size_t node_index(int column, int row) {
    return static_cast<std::size_t>(row) * kNodes + static_cast<std::size_t>(column);
}

// Variance of heights over a square.
double roughness(const HeightSource& source, double west, double south, double side) {
    double sum = 0.0, squares = 0.0;
    const double reference = source.height(west, south);
    for (int i = 0; i < kProbes * kProbes; ++i) {
        const int column = i % kProbes, row = i / kProbes;
        const double height = source.height(west + side * (column + 0.5) / kProbes,
                                            south + side * (row + 0.5) / kProbes) -
                              reference;
        sum += height;
        squares += height * height;
    }
    constexpr double kCount = kProbes * kProbes;
    return (squares - sum * sum / kCount) / kCount;
}

// The roughest of kWindows^2 squares spread evenly over an extent; ties go to the south-west.
Grid place_grid(const HeightSource& source, const WorldRect& extent, double side) {
    Grid grid;
    grid.spacing = side / (kNodes - 1);
    double roughest = -1.0;
    for (int i = 0; i < kWindows * kWindows; ++i) {
        const int column = i % kWindows, row = i / kWindows;
        const double share_x = static_cast<double>(column) / (kWindows - 1);
        const double share_y = static_cast<double>(row) / (kWindows - 1);
        const double west = extent.west + share_x * (extent.east - extent.west - side);
        const double south = extent.south + share_y * (extent.north - extent.south - side);
        const double rough = roughness(source, west, south, side);
        if (rough > roughest) {
            roughest = rough;
            grid.west = west;
            grid.south = south;
        }
    }
    return grid;
}

// Separable smoothing: along rows, then along columns.
std::vector<double> smoothed_grid(const std::vector<double>& value, int half_width) {
    std::vector<double> result = value;
    std::vector<double> line(kNodes);
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < kNodes; ++i) {
            const auto at = [&](int j) { return pass == 0 ? node_index(j, i) : node_index(i, j); };
            for (int j = 0; j < kNodes; ++j) line[static_cast<std::size_t>(j)] = result[at(j)];
            const std::vector<double> mean = smoothed(line, half_width);
            for (int j = 0; j < kNodes; ++j) result[at(j)] = mean[static_cast<std::size_t>(j)];
        }
    }
    return result;
}

// Cost per metre at each node, from kCheapest on valley floors to 1 + kCheapest on ridges.
std::vector<double> cost_of(const std::vector<double>& height) {
    const std::vector<double> local = smoothed_grid(height, 1);
    const std::vector<double> around = smoothed_grid(height, kNodes / 24);
    std::vector<double> cost(height.size());
    double squares = 0.0;
    for (std::size_t i = 0; i < height.size(); ++i) {
        cost[i] = local[i] - around[i];
        squares += cost[i] * cost[i];
    }
    const double deviation = std::sqrt(squares / static_cast<double>(height.size()));
    for (double& c : cost) {
        const double rank =
            deviation > 0.0 ? std::clamp((c / deviation + 1.5) / 3.0, 0.0, 1.0) : 0.5;
        c = kCheapest + rank * rank;
    }
    return cost;
}

struct Route {
    std::vector<std::size_t> nodes;
    double cost = 0.0;
};

// The cheapest path from the western to the eastern side, or from the southern to the northern one
// (Dijkstra). Ties go to the lower node.
Route cheapest_route(const std::vector<double>& cost, bool to_north) {
    constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    std::vector<double> best(cost.size(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> from(cost.size(), kNone);
    using Entry = std::pair<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    // routes start outside the outer sixths, so that they do not follow the border of the grid
    for (int i = kNodes / 6; i < kNodes - kNodes / 6; ++i) {
        const std::size_t start = to_north ? node_index(i, 0) : node_index(0, i);
        best[start] = cost[start];
        queue.emplace(best[start], start);
    }
    while (!queue.empty()) {
        const auto [reached, node] = queue.top();
        queue.pop();
        if (reached > best[node]) continue;
        const int column = static_cast<int>(node % kNodes);
        const int row = static_cast<int>(node / kNodes);
        if ((to_north ? row : column) == kNodes - 1) {
            Route route;
            route.cost = reached;
            for (std::size_t at = node; at != kNone; at = from[at]) route.nodes.push_back(at);
            std::reverse(route.nodes.begin(), route.nodes.end());
            return route;
        }
        for (int i = 0; i < 9; ++i) {
            const int next_column = column + i % 3 - 1;
            const int next_row = row + i / 3 - 1;
            if (i == 4 || next_column < 0 || next_row < 0 || next_column >= kNodes ||
                next_row >= kNodes) {
                continue;
            }
            const std::size_t next = node_index(next_column, next_row);
            const double distance =
                next_column != column && next_row != row ? 1.4142135623730951 : 1.0;
            const double total = reached + distance * 0.5 * (cost[node] + cost[next]);
            if (total < best[next]) {
                best[next] = total;
                from[next] = node;
                queue.emplace(total, next);
            }
        }
    }
    return {};
}

// The line extended straight by `length` at both ends.
std::vector<Eigen::Vector2d> extended(const std::vector<Eigen::Vector2d>& line, double length) {
    const std::size_t reach = std::min<std::size_t>(line.size() - 1, 8);
    const Eigen::Vector2d backward = (line.front() - line[reach]).normalized();
    const Eigen::Vector2d forward = (line.back() - line[line.size() - 1 - reach]).normalized();
    std::vector<Eigen::Vector2d> result{line.front() + length * backward};
    result.insert(result.end(), line.begin(), line.end());
    result.emplace_back(line.back() + length * forward);
    return result;
}

std::vector<Eigen::Vector2d> smoothed_line(const std::vector<Eigen::Vector2d>& line,
                                           std::ptrdiff_t half_width) {
    std::vector<double> x, y;
    for (const Eigen::Vector2d& p : line) {
        x.push_back(p.x());
        y.push_back(p.y());
    }
    x = smoothed(std::move(x), half_width);
    y = smoothed(std::move(y), half_width);
    std::vector<Eigen::Vector2d> result;
    for (std::size_t i = 0; i < x.size(); ++i) result.emplace_back(x[i], y[i]);
    return result;
}

// The section of `count` points with the least total cost; ties go to the first.
std::vector<Eigen::Vector2d> cheapest_section(const std::vector<Eigen::Vector2d>& line,
                                              std::size_t count, const Grid& grid,
                                              const std::vector<double>& cost) {
    if (line.size() <= count) return line;
    std::vector<double> sums{0.0};  // prefix sums of the cost
    for (const Eigen::Vector2d& p : line) {
        const double column = std::floor((p.x() - grid.west) / grid.spacing + 0.5);
        const double row = std::floor((p.y() - grid.south) / grid.spacing + 0.5);
        const bool is_known = column >= 0.0 && row >= 0.0 && column < kNodes && row < kNodes;
        sums.push_back(sums.back() +
                       (is_known ? cost[node_index(static_cast<int>(column), static_cast<int>(row))]
                                 : 1.0 + kCheapest));
    }
    std::size_t best = 0;
    for (std::size_t first = 1; first + count <= line.size(); ++first) {
        if (sums[first + count] - sums[first] < sums[best + count] - sums[best]) best = first;
    }
    const auto begin = line.begin() + static_cast<std::ptrdiff_t>(best);
    return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace

Result<std::vector<Eigen::Vector2d>> find_canyon_route(const HeightSource& source,
                                                       const WorldRect& region, double length,
                                                       double turn_length) {
    const double room = 0.94 * std::min(region.east - region.west, region.north - region.south);
    const double side = std::min(room, std::max({1.2 * length, 8.0 * turn_length, kLeastSide}));
    Grid grid = place_grid(source, region, side);
    grid.value.resize(std::size_t{kNodes} * kNodes);
    for (int row = 0; row < kNodes; ++row) {
        for (int column = 0; column < kNodes; ++column) {
            const double height =
                source.height(grid.west + column * grid.spacing, grid.south + row * grid.spacing);
            if (!std::isfinite(height)) {
                return fail(ErrorCode::io, "the terrain cannot be read where the path would go");
            }
            grid.value[node_index(column, row)] = height;
        }
    }
    const std::vector<double> cost = cost_of(grid.value);
    const Route eastward = cheapest_route(cost, false);
    const Route northward = cheapest_route(cost, true);
    const Route& route = northward.cost < eastward.cost ? northward : eastward;

    std::vector<Eigen::Vector2d> line;
    for (const std::size_t node : route.nodes) {
        const std::size_t column = node % kNodes, row = node / kNodes;
        line.emplace_back(grid.west + static_cast<double>(column) * grid.spacing,
                          grid.south + static_cast<double>(row) * grid.spacing);
    }
    // grid steps have corners: smooth over the turn length
    const double spacing = std::max(turn_length / 100.0, grid.spacing / 4.0);
    const auto half_width = static_cast<std::ptrdiff_t>(turn_length / spacing / 6.0) + 1;
    line = resampled(extended(line, 0.5 * length + turn_length), spacing);
    line = smoothed_line(smoothed_line(line, half_width), half_width);
    line = resampled(line, spacing);

    return cheapest_section(line, static_cast<std::size_t>(length / spacing) + 2, grid, cost);
}

}  // namespace terrane::internal
