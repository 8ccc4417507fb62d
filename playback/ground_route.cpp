// SPDX-License-Identifier: MIT
//
// Sources: E. W. Dijkstra. A note on two problems in connexion with graphs. 1959 (cheapest route).
//          A. Weiss. Topographic position and landforms analysis. ESRI user conference 2001 (valleys are lower than
//          the mean of their surroundings).
#include "ground_route.h"

#include "curve.h"

#include <terrane/playback/camera_path.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <span>
#include <utility>

namespace terrane::internal {
namespace {

using Eigen::Vector2d;

constexpr int kNodes = 192;            // nodes along a side of the search grid
constexpr int kWindows = 5;            // candidate positions of the grid along a side
constexpr int kProbes = 12;            // samples along a side for measuring roughness
constexpr double kLeastSide = 6000.0;  // metres: smaller squares rarely contain a valley
constexpr std::size_t kOverlaps = 4;   // sections of a valley that overlap
constexpr double kCheapest = 0.03;     // cost of a valley floor relative to a ridge: limits detours

struct Grid {
    double west = 0.0, south = 0.0, spacing = 1.0;
    std::vector<double> value;  // [kNodes^2] from the south-west
};

std::size_t node_index(int column, int row) {
    return static_cast<std::size_t>(row) * kNodes + static_cast<std::size_t>(column);
}

// Variance of the heights in a square.
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

// Places the grid on the roughest of kWindows^2 squares spread evenly over an extent; ties go to the south-west.
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

// Separable smoothing: rows, then columns.
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

// A step on a grid: columns to the east, rows to the north.
using GridStep = std::array<std::ptrdiff_t, 2>;
constexpr std::array<GridStep, 16> kSteps{{{-1, -1},
                                           {0, -1},
                                           {1, -1},
                                           {-1, 0},
                                           {1, 0},
                                           {-1, 1},
                                           {0, 1},
                                           {1, 1},
                                           {-2, -1},
                                           {-1, -2},
                                           {1, -2},
                                           {2, -1},
                                           {-2, 1},
                                           {-1, 2},
                                           {1, 2},
                                           {2, 1}}};
constexpr std::size_t kNeighbours = 8;  // of a node: the first of kSteps

// The cheapest path over a grid from some nodes, each with the cost of starting there, to the nearest goal (Dijkstra).
// Ties go to the lower node index. Empty if there is no path of finite cost. The cost of a step may depend on the node
// before it, itself at a start; the path is then only nearly the cheapest.
template <class IsGoal, class StepCost>
Route cheapest_route(std::size_t columns, std::size_t rows, std::span<const GridStep> steps,
                     const std::vector<std::pair<double, std::size_t>>& starts, IsGoal&& is_goal,
                     StepCost&& step_cost) {
    constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    std::vector<double> best(columns * rows, std::numeric_limits<double>::infinity());
    std::vector<std::size_t> from(columns * rows, kNone);
    using Entry = std::pair<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (const auto& [start_cost, start] : starts) {
        best[start] = start_cost;
        queue.emplace(start_cost, start);
    }
    while (!queue.empty()) {
        const auto [reached, node] = queue.top();
        queue.pop();
        if (reached > best[node]) continue;
        if (is_goal(node)) {
            Route route;
            route.cost = reached;
            for (std::size_t at = node; at != kNone; at = from[at]) route.nodes.push_back(at);
            std::reverse(route.nodes.begin(), route.nodes.end());
            return route;
        }
        for (const GridStep& step : steps) {
            // left of the first column or below the first row, the sum wraps to more than any index
            const std::size_t column = node % columns + static_cast<std::size_t>(step[0]);
            const std::size_t row = node / columns + static_cast<std::size_t>(step[1]);
            if (column >= columns || row >= rows) continue;
            const std::size_t next = row * columns + column;
            const std::size_t before = from[node] == kNone ? node : from[node];
            const double total = reached + step_cost(before, node, next);
            if (total < best[next]) {
                best[next] = total;
                from[next] = node;
                queue.emplace(total, next);
            }
        }
    }
    return {};
}

// The cheapest path through valleys from the western to the eastern side, or from the southern to the northern one.
Route cheapest_valley(const std::vector<double>& cost, bool to_north) {
    std::vector<std::pair<double, std::size_t>> starts;
    // Routes start at least a sixth of the side away from the corners, so that they do not follow the border of the
    // grid.
    for (int i = kNodes / 6; i < kNodes - kNodes / 6; ++i) {
        const std::size_t start = to_north ? node_index(i, 0) : node_index(0, i);
        starts.emplace_back(cost[start], start);
    }
    const auto is_goal = [to_north](std::size_t node) {
        return (to_north ? node / kNodes : node % kNodes) == kNodes - 1;
    };
    const auto step_cost = [&cost](std::size_t, std::size_t a, std::size_t b) {
        const bool is_diagonal = a % kNodes != b % kNodes && a / kNodes != b / kNodes;
        const double distance = is_diagonal ? 1.4142135623730951 : 1.0;
        return distance * 0.5 * (cost[a] + cost[b]);
    };
    return cheapest_route(kNodes, kNodes, std::span(kSteps).first(kNeighbours), starts, is_goal,
                          step_cost);
}

std::vector<Vector2d> smoothed_line(const std::vector<Vector2d>& line, std::ptrdiff_t half_width) {
    std::vector<double> x, y;
    for (const Vector2d& p : line) {
        x.push_back(p.x());
        y.push_back(p.y());
    }
    x = smoothed(std::move(x), half_width);
    y = smoothed(std::move(y), half_width);
    std::vector<Vector2d> result;
    for (std::size_t i = 0; i < x.size(); ++i) result.emplace_back(x[i], y[i]);
    return result;
}

// Index of the section of `count` consecutive points with the least total cost; ties go to the first.
std::size_t cheapest_section(const std::vector<Vector2d>& line, std::size_t count, const Grid& grid,
                             const std::vector<double>& cost) {
    std::vector<double> sums{0.0};  // prefix sums of the cost
    for (const Vector2d& p : line) {
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
    return best;
}

std::vector<Vector2d> section_of(const std::vector<Vector2d>& line, std::size_t first,
                                 std::size_t count) {
    const auto begin = line.begin() + static_cast<std::ptrdiff_t>(first);
    return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace

std::vector<Vector2d> extended(const std::vector<Vector2d>& line, double length) {
    const std::size_t reach = std::min<std::size_t>(line.size() - 1, 8);
    const Vector2d backward = (line.front() - line[reach]).normalized();
    const Vector2d forward = (line.back() - line[line.size() - 1 - reach]).normalized();
    std::vector<Vector2d> result{line.front() + length * backward};
    result.insert(result.end(), line.begin(), line.end());
    result.emplace_back(line.back() + length * forward);
    return result;
}

Result<std::vector<std::vector<Vector2d>>> find_canyon_routes(const HeightSource& source,
                                                              const WorldRect& region,
                                                              double length, double turn_length) {
    const double limit = 0.94 * std::min(region.east - region.west, region.north - region.south);
    const double side = std::min(limit, std::max({1.2 * length, 8.0 * turn_length, kLeastSide}));
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
    const Route eastward = cheapest_valley(cost, false);
    const Route northward = cheapest_valley(cost, true);
    const bool is_northward = northward.cost < eastward.cost;

    std::vector<std::vector<Vector2d>> sections;
    for (const Route* route :
         {is_northward ? &northward : &eastward, is_northward ? &eastward : &northward}) {
        std::vector<Vector2d> line;
        for (const std::size_t node : route->nodes) {
            const std::size_t column = node % kNodes, row = node / kNodes;
            line.emplace_back(grid.west + static_cast<double>(column) * grid.spacing,
                              grid.south + static_cast<double>(row) * grid.spacing);
        }
        // Smoothing over the turn length removes the corners of the path on the grid.
        const double spacing = std::max(turn_length / 100.0, grid.spacing / 4.0);
        const auto half_width = static_cast<std::ptrdiff_t>(turn_length / spacing / 6.0) + 1;
        line = resampled(extended(line, 0.5 * length + turn_length), spacing);
        line = smoothed_line(smoothed_line(line, half_width), half_width);
        line = resampled(line, spacing);

        const std::size_t count =
            std::min(line.size(), static_cast<std::size_t>(length / spacing) + 2);
        if (sections.empty()) {
            sections.push_back(section_of(line, cheapest_section(line, count, grid, cost), count));
        }
        for (std::size_t first = 0; first + count <= line.size(); first += count / kOverlaps + 1) {
            sections.push_back(section_of(line, first, count));
            sections.emplace_back(sections.back().rbegin(), sections.back().rend());
        }
    }
    return sections;
}

namespace {

constexpr double kLeastStep = 1.0, kMostStep = 3.0;  // metres between nodes of a strip
constexpr double kUsualSteps = 240.0;                // along a line
constexpr double kMostSteps = 4096.0;
constexpr int kHalfRows = 26;           // of a strip, on each side of its line
constexpr int kFineHalfRows = 10;       // of the strip along the route of a coarser one
constexpr double kWantedSlope = 0.6;    // upward and across, relative to the limit
constexpr double kWantedDown = 0.8;     // downward
constexpr double kWantedBump = 0.6;     // along the way, relative to the limit
constexpr double kBumpAcross = 0.5;     // weight of the squared bump across the way
constexpr double kEasy = 0.3;           // share of the wanted slope that costs nothing
constexpr double kSteepCost = 6.0;      // of the excess beyond kEasy, squared
constexpr double kTooSteepCost = 20.0;  // beyond the wanted slope
constexpr double kTooSteepRise = 50.0;  // of the excess beyond it
constexpr double kTurnCost = 3.0;       // metres, of the squared angle between two steps
constexpr double kNoGroundCost = 1e4;
constexpr double kAsideCost = 0.3;    // at the edge of a strip
constexpr double kFold = 0.7;         // most share of a bend's radius on its inner side
constexpr double kStartWeight = 5.0;  // steps that the start counts for
constexpr double kFarCost = 0.5;      // of a move by `reach`
constexpr std::array<double, 5> kFar{0.0, 0.125, 0.25, 0.5, 1.0};  // moves relative to `reach`
constexpr std::size_t kFinalists = 30;  // placements whose strips are searched
constexpr double kHalfRoot = 0.7071067811865476;
constexpr std::array<std::array<double, 2>, 8> kHeadings{{{1.0, 0.0},
                                                          {kHalfRoot, kHalfRoot},
                                                          {kHalfRoot, -kHalfRoot},
                                                          {0.0, 1.0},
                                                          {0.0, -1.0},
                                                          {-kHalfRoot, kHalfRoot},
                                                          {-kHalfRoot, -kHalfRoot},
                                                          {-1.0, 0.0}}};

// Directions of bumps: a half turn in four steps.
constexpr std::array<std::array<double, 2>, 4> kBumpWays{
    {{1.0, 0.0}, {kHalfRoot, kHalfRoot}, {0.0, 1.0}, {-kHalfRoot, kHalfRoot}}};

// The ground at a point, and whether there is any.
struct Footing {
    Vector2d slope = Vector2d::Zero();  // rise over run, towards east and north
    // height above the mean of the ground on both sides, along each of kBumpWays, metres
    std::array<double, 4> bump{};
    bool is_ground = true;
};

class ClimbedGround {
public:
    ClimbedGround(const HeightSource& source, const GroundLimits& limits)
        : source_(source), limits_(limits) {}

    Result<Footing> at(const Vector2d& p) const {
        Footing footing;
        TERRANE_TRY(footing.is_ground, is_over_ground(source_, p.x(), p.y()));
        const double reach = limits_.bump_reach;
        const double middle = source_.height(p.x(), p.y());
        Vector2d sum(0.0, 0.0);
        for (std::size_t i = 0; i < kBumpWays.size(); ++i) {
            const Vector2d way(kBumpWays[i][0], kBumpWays[i][1]);
            const double ahead = source_.height(p.x() + reach * way.x(), p.y() + reach * way.y());
            const double behind = source_.height(p.x() - reach * way.x(), p.y() - reach * way.y());
            footing.bump[i] = middle - 0.5 * (ahead + behind);
            sum += (ahead - behind) * way;
        }
        footing.slope = sum / (4.0 * reach);  // of the plane with the least squared error
        if (!footing.slope.allFinite()) {
            return fail(ErrorCode::io, "the terrain cannot be read where the path would go");
        }
        return footing;
    }

    bool can_be_climbed(const Footing& footing) const {
        return footing.is_ground && footing.slope.norm() <= limits_.max_slope &&
               std::ranges::all_of(footing.bump, [this](double bump) {
                   return std::abs(bump) <= limits_.max_bump;
               });
    }

    // The cost of a metre in a direction of length 1; 1 on easy ground.
    double cost(const Footing& footing, const Vector2d& along) const {
        if (!footing.is_ground) return kNoGroundCost;
        const Vector2d& slope = footing.slope;
        const double climb = slope.x() * along.x() + slope.y() * along.y();
        const double tilt = slope.x() * along.y() - slope.y() * along.x();
        const double up = climb / ((climb > 0.0 ? kWantedSlope : kWantedDown) * limits_.max_slope);
        const double across = tilt / (kWantedSlope * limits_.max_slope);
        const double share = std::sqrt(up * up + across * across + square_bump(footing, along));
        const double beyond_easy = std::max(0.0, share - kEasy);
        const double too_steep = share > 1.0 ? kTooSteepCost + kTooSteepRise * (share - 1.0) : 0.0;
        return 1.0 + kSteepCost * beyond_easy * beyond_easy + too_steep;
    }

private:
    // The square of the bump along a direction, and some of that across it, relative to the wanted one.
    double square_bump(const Footing& footing, const Vector2d& along) const {
        const double wanted = kWantedBump * limits_.max_bump;
        const double cosine = along.x() * along.x() - along.y() * along.y();  // of twice the angle
        const double sine = 2.0 * along.x() * along.y();
        const std::array<double, 4> weight{std::max(0.0, cosine), std::max(0.0, sine),
                                           std::max(0.0, -cosine), std::max(0.0, -sine)};
        double sum = 0.0, weights = 0.0;
        for (std::size_t i = 0; i < weight.size(); ++i) {
            const double bump = footing.bump[i], across = footing.bump[(i + 2) % 4];
            sum += weight[i] * (bump * bump + kBumpAcross * across * across);
            weights += weight[i];
        }
        return sum / (weights * wanted * wanted);
    }

    const HeightSource& source_;
    GroundLimits limits_;
};

// Unit vectors to the left of a line with equidistant points.
std::vector<Vector2d> normals_of(const std::vector<Vector2d>& line) {
    std::vector<Vector2d> normals;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const Vector2d along = line[std::min(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : 0];
        const double length = std::sqrt(along.x() * along.x() + along.y() * along.y());
        normals.emplace_back(length > 0.0 ? Vector2d(-along.y() / length, along.x() / length)
                                          : Vector2d(0.0, 0.0));
    }
    return normals;
}

// The cheapest route in a strip of nodes along a line, from any node of its first column to any of its last.
Result<Route> find_in_strip(const std::vector<Vector2d>& line, double step, int half_rows,
                            const ClimbedGround& ground, std::vector<Vector2d>& nodes_out) {
    const std::size_t columns = line.size(), rows = 2 * static_cast<std::size_t>(half_rows) + 1;
    const std::vector<Vector2d> normals = normals_of(line);
    std::vector<double> weight(columns * rows, std::numeric_limits<double>::infinity());
    std::vector<Footing> footing(columns * rows);
    nodes_out.resize(columns * rows);
    for (std::size_t column = 0; column < columns; ++column) {
        const Vector2d& a = normals[column > 0 ? column - 1 : 0];
        const Vector2d& b = normals[std::min(column + 1, columns - 1)];
        const double bend = 0.5 * (a.x() * b.y() - a.y() * b.x()) / step;  // 1 / radius, left > 0
        for (std::size_t row = 0; row < rows; ++row) {
            const double share = (static_cast<double>(row) - half_rows) / half_rows;
            const double aside = share * half_rows * step;
            const std::size_t node = row * columns + column;
            nodes_out[node] = line[column] + aside * normals[column];
            if (aside * bend > kFold) continue;
            weight[node] = 1.0 + kAsideCost * share * share;
            TERRANE_TRY(footing[node], ground.at(nodes_out[node]));
        }
    }
    std::vector<std::pair<double, std::size_t>> starts;
    for (std::size_t row = 0; row < rows; ++row) {
        const std::size_t node = row * columns;
        const Vector2d along(normals.front().y(), -normals.front().x());
        const double cost = kStartWeight * step * weight[node] * ground.cost(footing[node], along);
        if (std::isfinite(cost)) starts.emplace_back(cost, node);
    }
    const auto is_goal = [columns](std::size_t node) { return node % columns == columns - 1; };
    const auto step_cost = [&](std::size_t before, std::size_t from, std::size_t to) {
        const Vector2d way = nodes_out[to] - nodes_out[from];
        const double length = std::sqrt(way.x() * way.x() + way.y() * way.y());
        if (!(length > 0.0)) return 0.0;
        double turn = 0.0;
        if (const Vector2d old = nodes_out[from] - nodes_out[before]; before != from) {
            const double scale = length * std::sqrt(old.x() * old.x() + old.y() * old.y());
            const double cosine =
                scale > 0.0 ? (old.x() * way.x() + old.y() * way.y()) / scale : 1.0;
            turn = kTurnCost * 2.0 * (1.0 - cosine);
        }
        return turn + 0.5 * length *
                          (weight[from] * ground.cost(footing[from], way / length) +
                           weight[to] * ground.cost(footing[to], way / length));
    };
    return cheapest_route(columns, rows, kSteps, starts, is_goal, step_cost);
}

std::vector<Vector2d> moved(const std::vector<Vector2d>& line, const LinePlacement& placement) {
    std::vector<Vector2d> result;
    for (const Vector2d& p : line) result.push_back(placement.moved(p));
    return result;
}

struct Candidate {
    std::size_t line = 0;
    LinePlacement placement;
    double cost = 0.0;  // a metre
};

// Mean cost of a line, whose points may each move by a quarter of a strip to either side.
Result<double> rough_cost(const std::vector<Vector2d>& line, double step,
                          const ClimbedGround& ground) {
    constexpr std::size_t kStride = 2, kStartPoints = 2;
    const std::vector<Vector2d> normals = normals_of(line);
    double sum = 0.0, count = 0.0;
    for (std::size_t i = 0; i < line.size(); i += kStride) {
        double least = std::numeric_limits<double>::infinity();
        for (const double share : {0.0, 0.25, -0.25}) {
            TERRANE_TRY(const Footing footing,
                        ground.at(line[i] + share * kHalfRows * step * normals[i]));
            const Vector2d along(normals[i].y(), -normals[i].x());
            least = std::min(least, ground.cost(footing, along));
            if (least <= 1.0) break;
        }
        const double weight = i < kStride * kStartPoints ? kStartWeight : 1.0;
        sum += weight * least;
        count += weight;
    }
    return sum / count;
}

// The best lines, places and headings by their rough costs, best first; ties go to the first line and the nearest.
Result<std::vector<Candidate>> rank_placements(const std::vector<std::vector<Vector2d>>& lines,
                                               double step, const ClimbedGround& ground,
                                               const RouteFreedom& freedom) {
    std::vector<Candidate> candidates;
    const auto add = [&](std::size_t line, const Vector2d& move, const Vector2d& turn,
                         double share) -> Result<void> {
        const LinePlacement placement{freedom.pivot, freedom.pivot + move, turn};
        TERRANE_TRY(const double rough, rough_cost(moved(lines[line], placement), step, ground));
        candidates.push_back({line, placement, rough + kFarCost * share});
        return {};
    };
    for (std::size_t line = 0; line < lines.size(); ++line) {
        for (const double share : kFar) {
            for (const auto& [east, north] : kHeadings) {
                for (const auto& [cosine, sine] : kHeadings) {
                    const double reach = share * freedom.reach;
                    TERRANE_TRY(
                        add(line, reach * Vector2d(east, north), Vector2d(cosine, sine), share));
                    if (freedom.is_fixed) break;
                }
                if (freedom.is_fixed || share == 0.0 || freedom.reach == 0.0) break;
            }
            if (freedom.is_fixed || freedom.reach == 0.0) break;
        }
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
    if (candidates.size() > kFinalists) candidates.resize(kFinalists);
    return candidates;
}

}  // namespace

Result<std::optional<GroundRoute>> lay_over_climbable_ground(
    const std::vector<std::vector<Vector2d>>& lines, const HeightSource& source,
    const RouteFreedom& freedom) {
    const std::vector<Vector2d>& line = lines.front();
    double length = 0.0;
    for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
    const double step =
        std::max(std::clamp(length / kUsualSteps, kLeastStep, kMostStep), length / kMostSteps);
    std::vector<std::vector<Vector2d>> guides;
    for (const std::vector<Vector2d>& each : lines) guides.push_back(resampled(each, step));
    if (guides.front().size() < 2) return std::nullopt;
    const ClimbedGround ground(source, freedom.limits);
    bool is_climbable = true;
    for (const Vector2d& p : guides.front()) {
        TERRANE_TRY(const Footing footing, ground.at(p));
        is_climbable = is_climbable && ground.can_be_climbed(footing);
    }
    if (is_climbable) return std::nullopt;

    TERRANE_TRY(const std::vector<Candidate> candidates,
                rank_placements(guides, step, ground, freedom));
    GroundRoute result;
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& candidate : candidates) {
        std::vector<Vector2d> nodes;
        TERRANE_TRY(const Route route,
                    find_in_strip(moved(guides[candidate.line], candidate.placement), step,
                                  kHalfRows, ground, nodes));
        if (route.nodes.empty() || route.cost >= least) continue;
        least = route.cost;
        result.placement = candidate.placement;
        result.line.clear();
        for (const std::size_t node : route.nodes) result.line.push_back(nodes[node]);
    }
    if (result.line.empty()) return std::nullopt;
    // removes the corners of a route on the grid
    const auto rounded = [](const std::vector<Vector2d>& corners, double spacing) {
        constexpr std::ptrdiff_t kHalfWidth = 3;
        const double margin = 4.0 * kHalfWidth * spacing;
        const std::vector<Vector2d> smooth =
            smoothed_line(resampled(extended(corners, margin), spacing), kHalfWidth);
        const auto cut = static_cast<std::ptrdiff_t>(margin / spacing);
        return std::vector<Vector2d>(smooth.begin() + cut, smooth.end() - cut);
    };
    result.line = rounded(result.line, 0.5 * step);
    // between the nodes of the coarse strip, nothing was looked at
    const double fine_step = std::max(kLeastStep, length / kMostSteps);
    if (!(fine_step < step)) return result;
    std::vector<Vector2d> nodes;
    TERRANE_TRY(const Route route, find_in_strip(resampled(result.line, fine_step), fine_step,
                                                 kFineHalfRows, ground, nodes));
    if (route.nodes.empty()) return result;
    result.line.clear();
    for (const std::size_t node : route.nodes) result.line.push_back(nodes[node]);
    result.line = rounded(result.line, 0.5 * fine_step);
    return result;
}

}  // namespace terrane::internal

namespace terrane {

Result<bool> is_over_ground(const HeightSource& source, double x, double y) {
    const WorldRect& extent = source.extent();
    if (!extent.contains(x, y)) return false;
    const Lattice& lattice = source.lattice();
    // the inner edges of the extent belong to the cells inside
    const double margin = 1e-6 * lattice.spacing;
    const auto index = [&](double at, double low, double high, double origin) {
        const double inside = std::max(std::min(at, high - margin), low + margin);
        return static_cast<std::int64_t>(std::floor((inside - origin) / lattice.spacing));
    };
    const LatticePoint corner{index(x, extent.west, extent.east, lattice.origin_x),
                              index(y, extent.south, extent.north, lattice.origin_y)};
    std::uint8_t flags = cell_ground;
    TERRANE_TRY(source.cell_flags({corner, 1, 2, 2}, {&flags, 1}));
    return (flags & cell_outside) == 0;
}

}  // namespace terrane
