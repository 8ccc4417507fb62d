// SPDX-License-Identifier: MIT
#include "camera_legs.h"
#include "curve.h"

#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace terrane::internal {

/// A polyline in plan along low ground: through the valleys of the roughest part of a region of a terrain.
///
/// The polyline is smoothed: a turn takes about `turn_length` metres. If the region is shorter than `length`, both ends
/// of the polyline are extended straight.
///
/// @param length metres, > 0
/// @return equidistant points, at least turn_length / 100 apart
///
/// Fails: io if the source cannot be read
/// Cost:  about 50,000 calls of HeightSource::height()
Result<std::vector<Eigen::Vector2d>> find_canyon_route(const HeightSource& source,
                                                       const WorldRect& region, double length,
                                                       double turn_length);

// Sources: E. W. Dijkstra. A note on two problems in connexion with graphs. 1959 (cheapest route).
//          A. Weiss. Topographic position and landforms analysis. ESRI user conference 2001 (valleys are lower than
//          the mean of their surroundings).

namespace {

constexpr int kNodes = 192;            // nodes along a side of the search grid
constexpr int kWindows = 5;            // candidate positions of the grid along a side
constexpr int kProbes = 12;            // samples along a side for measuring roughness
constexpr double kLeastSide = 6000.0;  // metres: smaller squares rarely contain a valley
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

// The cheapest path from the western to the eastern side, or from the southern to the northern one (Dijkstra). Ties go
// to the lower node index.
Route cheapest_route(const std::vector<double>& cost, bool to_north) {
    constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    std::vector<double> best(cost.size(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> from(cost.size(), kNone);
    using Entry = std::pair<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    // Routes start at least a sixth of the side away from the corners, so that they do not follow the border of the
    // grid.
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

// A line extended straight by `length` at both ends.
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

// The section of `count` consecutive points with the least total cost; ties go to the first.
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
    const Route eastward = cheapest_route(cost, false);
    const Route northward = cheapest_route(cost, true);
    const Route& route = northward.cost < eastward.cost ? northward : eastward;

    std::vector<Eigen::Vector2d> line;
    for (const std::size_t node : route.nodes) {
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

    return cheapest_section(line, static_cast<std::size_t>(length / spacing) + 2, grid, cost);
}

// Source: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (targets of teleports).

namespace {

using Eigen::Vector2d;

constexpr double kPi = 3.141592653589793;
constexpr std::array<std::string_view, 6> kPathNames{"straight", "orbit", "canyon",
                                                     "turns",    "spins", "teleports"};

Vector2d middle(const WorldRect& extent) {
    return {0.5 * (extent.west + extent.east), 0.5 * (extent.south + extent.north)};
}

Vector2d longer_side(const WorldRect& extent) {
    return extent.east - extent.west >= extent.north - extent.south ? Vector2d(1.0, 0.0)
                                                                    : Vector2d(0.0, 1.0);
}

double longer_length(const WorldRect& extent) {
    return std::max(extent.east - extent.west, extent.north - extent.south);
}

// Rotates a vector by a small angle, with an error of angle^5 / 120. Avoids the C library's sin(), whose bits differ
// between systems.
Vector2d turned(const Vector2d& v, double angle) {
    const double half = 0.5 * angle;
    const double q = half * (1.0 + half * half / 3.0);  // tangent of half the angle
    const double cosine = (1.0 - q * q) / (1.0 + q * q);
    const double sine = 2.0 * q / (1.0 + q * q);
    return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y()};
}

LegPlan make_straight(const Vector2d& start, const Vector2d& direction, double speed,
                      double duration) {
    LegPlan plan;
    plan.duration = duration;
    plan.control.resize(control_count(duration));
    for (std::size_t i = 0; i < plan.control.size(); ++i) {
        const Vector2d p = start + speed * control_time(i) * direction;
        plan.control[i] = {p.x(), p.y(), 0.0};
    }
    return plan;
}

LegPlan make_straight(const PlanPlace& place, double speed, double duration) {
    const Vector2d direction = longer_side(place.region);
    if (place.start_world) return make_straight(*place.start_world, direction, speed, duration);
    const double used = std::min(speed * duration, 0.96 * longer_length(place.region));
    return make_straight(middle(place.region) - 0.5 * used * direction, direction, speed, duration);
}

LegPlan make_orbit(const HeightSource& source, const PlanPlace& place, double speed,
                   double duration) {
    constexpr double kLeast = 10.0;  // smallest radius, metres
    const WorldRect& region = place.region;
    const double limit = 0.3 * std::min(region.east - region.west, region.north - region.south);
    const double radius = std::max(kLeast, std::min(speed * duration / (2.0 * kPi), limit));
    LegPlan plan;
    plan.duration = duration;
    plan.control.resize(control_count(duration));
    Vector2d arm(0.0, -radius), first_arm = arm;
    for (std::size_t i = 0; i < plan.control.size(); ++i) {
        plan.control[i] = {arm.x(), arm.y(), 0.0};
        if (control_time(i) <= 0.0) first_arm = arm;
        arm = turned(arm, speed * kLegStep / radius);
    }
    const Vector2d centre =
        place.start_world ? Vector2d(*place.start_world - first_arm) : middle(region);
    for (Eigen::Vector3d& point : plan.control) {
        point = {centre.x() + point.x(), centre.y() + point.y(), 0.0};
    }
    plan.target_world = WorldPos(centre.x(), centre.y(), source.height(centre.x(), centre.y()));
    return plan;
}

Result<LegPlan> make_canyon(const HeightSource& source, const WorldRect& region, double speed,
                            double duration) {
    constexpr double kTurnTime = 8.0;  // seconds per turn: limits the curvature of fast paths
    LegPlan plan;
    plan.duration = duration;
    plan.has_lean = true;
    const double length = speed * kLegStep * static_cast<double>(control_count(duration));
    TERRANE_TRY(const std::vector<Vector2d> route,
                find_canyon_route(source, region, length, kTurnTime * speed));
    for (const Vector2d& p : resampled(route, speed * kLegStep)) {
        plan.control.emplace_back(p.x(), p.y(), 0.0);
    }
    return plan;
}

// Back and forth, with a left half circle at each end. By default the first straight is centred on the region.
LegPlan make_turns(const PlanPlace& place, double speed, double duration) {
    constexpr double kStraightTime = 5.0;  // seconds
    constexpr double kTurnTime = 6.0;      // seconds
    constexpr int kSubsteps = 16;
    constexpr double kSubstep = kLegStep / kSubsteps;
    const double straight_time = std::min(kStraightTime, 0.5 * longer_length(place.region) / speed);
    const auto angle = [straight_time](double time) {
        if (time <= 0.0) return 0.0;
        const double period = std::floor(time / (straight_time + kTurnTime));
        const double s =
            std::max(0.0, time - period * (straight_time + kTurnTime) - straight_time) / kTurnTime;
        // Smoothstep of degree 5: the turn rate and its derivative are 0 at both ends.
        return kPi * (period + s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
    };
    LegPlan plan;
    plan.duration = duration;
    plan.control.resize(control_count(duration));
    Vector2d direction = longer_side(place.region);
    const Vector2d from = place.start_world ? Vector2d(*place.start_world) : middle(place.region);
    const double before = place.start_world ? 0.0 : 0.5 * straight_time;
    Vector2d at = from - (before + kLegPad) * speed * direction;
    for (std::size_t i = 0; i < plan.control.size(); ++i) {
        plan.control[i] = {at.x(), at.y(), 0.0};
        for (int j = 0; j < kSubsteps; ++j) {
            const double time = control_time(i) + j * kSubstep;
            const double turn = angle(time + kSubstep) - angle(time);
            at += speed * kSubstep * turned(direction, 0.5 * turn);
            direction = turned(direction, turn);
        }
    }
    return plan;
}

// Heading, radians, of a view that makes a turn at 90 degrees/s, rests, then makes half a turn back and forward again.
double spin_angle(double time) {
    constexpr double kRate = 0.5 * kPi;
    constexpr double kRamp = 0.75;  // seconds to reach kRate, and to stop
    struct Part {
        double seconds, angle;
    };
    constexpr auto turn = [](double angle) {
        return Part{(angle < 0.0 ? -angle : angle) / kRate + kRamp, angle};
    };
    constexpr std::array<Part, 6> kParts{Part{1.0, 0.0}, turn(2.0 * kPi), Part{1.0, 0.0},
                                         turn(-kPi),     turn(kPi),       Part{0.75, 0.0}};
    double period = 0.0;
    for (const Part& part : kParts) period += part.seconds;
    if (time <= 0.0) return 0.0;
    // A period adds a whole turn, so all periods are the same.
    double left = time - std::floor(time / period) * period;
    double sum = 0.0;
    for (const Part& part : kParts) {
        if (left < part.seconds && part.angle != 0.0) {
            const double rest = part.seconds - left;
            const double rate = part.angle < 0.0 ? -kRate : kRate;
            if (left < kRamp) return sum + 0.5 * rate * left * left / kRamp;
            if (rest < kRamp) return sum + part.angle - 0.5 * rate * rest * rest / kRamp;
            return sum + rate * (left - 0.5 * kRamp);
        }
        if (left < part.seconds) return sum;
        left -= part.seconds;
        sum += part.angle;
    }
    return sum;
}

LegPlan make_spins(const PlanPlace& place, double speed, double duration) {
    constexpr double kStep = 1.0 / 32.0;
    LegPlan plan = make_straight(place, speed, duration);
    std::vector<Eigen::Vector3d> control;
    Vector2d arm(1.0, 0.0);
    double angle = 0.0;
    for (double time = 0.0; time <= duration + kStep; time += kStep) {
        const double next = spin_angle(time);
        // Between two periods the angle drops by a whole turn, which is no rotation.
        if (const double step = next - angle; std::abs(step) < kPi) arm = turned(arm, step);
        angle = next;
        control.emplace_back(arm.x(), arm.y(), 0.0);
    }
    plan.turn = SmoothCurve(0.0, kStep, std::move(control));
    return plan;
}

std::vector<LegPlan> make_teleports(const WorldRect& extent, double speed, double duration) {
    constexpr double kStay = 5.0;     // seconds
    constexpr double kInside = 0.7;   // share of the extent in which the centres of legs lie
    constexpr double kFarOff = 0.25;  // of the shorter side: least distance between successive legs
    const Vector2d size(extent.east - extent.west, extent.north - extent.south);
    const auto place = [&](int i) {
        const Vector2d share(0.5 + 0.7548776662466927 * i, 0.5 + 0.5698402909980532 * i);
        const Vector2d inside = share - share.array().floor().matrix() - Vector2d(0.5, 0.5);
        return Vector2d(middle(extent) + kInside * inside.cwiseProduct(size));
    };
    std::vector<LegPlan> legs;
    Vector2d direction = longer_side(extent);
    Vector2d centre = place(0);
    int next = 1;
    for (double start = 0.0; start < duration; start += kStay) {
        const double stay = std::min(kStay, duration - start);
        legs.push_back(
            make_straight(centre - 0.5 * speed * kStay * direction, direction, speed, stay));
        const Vector2d last = centre;
        do {
            centre = place(next++);
        } while ((centre - last).norm() < kFarOff * size.minCoeff());
        // Turns by about 106 degrees, so that headings practically never repeat.
        direction = {-0.28 * direction.x() - 0.96 * direction.y(),
                     0.96 * direction.x() - 0.28 * direction.y()};
    }
    return legs;
}

}  // namespace

std::span<const std::string_view> built_in_names() { return kPathNames; }

Result<std::vector<LegPlan>> plan_built_in(std::string_view name, const HeightSource& source,
                                           const PlanPlace& place, double speed, double duration) {
    if (name == "teleports") return make_teleports(place.region, speed, duration);
    std::vector<LegPlan> legs;
    if (name == "canyon") {
        TERRANE_TRY(LegPlan canyon, make_canyon(source, place.region, speed, duration));
        legs.push_back(std::move(canyon));
    } else if (name == "orbit") {
        legs.push_back(make_orbit(source, place, speed, duration));
    } else if (name == "turns") {
        legs.push_back(make_turns(place, speed, duration));
    } else if (name == "spins") {
        legs.push_back(make_spins(place, speed, duration));
    } else {
        TERRANE_ASSERT(name == "straight", "the name must be one of the built-in paths'");
        legs.push_back(make_straight(place, speed, duration));
    }
    return legs;
}

}  // namespace terrane::internal
