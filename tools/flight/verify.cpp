// SPDX-License-Identifier: MIT
// Sources: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (R2 and R1: the
//          points of a sequence that fill a square, and a line, evenly at any length).
#include "flight/verify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

namespace terrane::tools {
namespace {

// Fractions of the multiples of these fill a square evenly.
constexpr double kR2x = 0.7548776662466927;
constexpr double kR2y = 0.5698402909980532;

double fraction(double value) { return value - std::floor(value); }

bool is_inside(const Frustum& frustum, const WorldPos& eye_world, const WorldPos& p_world) {
    const Eigen::Vector3d way = p_world - eye_world;
    for (const Eigen::Vector3d& normal : frustum.normals) {
        if (normal.dot(way) < 0.0) return false;
    }
    return true;
}

double to_pixels(const View& view, double metres, double distance) {
    return metres * view.pixels_per_radian() / std::max(view.near_distance, distance);
}

// Directions in the plane that can meet the view: all of them where it holds the vertical.
struct Wedge {
    double first = 0.0, span = 2.0 * std::numbers::pi;  // radians from east
};

Wedge find_wedge(const View& view, const Frustum& frustum) {
    const WorldPos below = view.eye_world - WorldPos(0.0, 0.0, 1.0);
    const WorldPos above = view.eye_world + WorldPos(0.0, 0.0, 1.0);
    if (is_inside(frustum, view.eye_world, below) || is_inside(frustum, view.eye_world, above)) {
        return {};
    }
    // The pyramid does not hold the vertical, so its corners span less than half a turn around the
    // middle of the picture.
    const double middle = std::atan2(view.forward.y(), view.forward.x());
    const double half_height = std::tan(0.5 * view.vertical_fov);
    const double half_width = half_height * view.width_px / view.height_px;
    const Eigen::Vector3d right = view.right();
    double low = 0.0, high = 0.0;
    for (int i = 0; i < 4; ++i) {
        const Eigen::Vector3d corner = view.forward +
                                       (i % 2 == 0 ? -half_width : half_width) * right +
                                       (i / 2 == 0 ? -half_height : half_height) * view.up;
        double turn = std::atan2(corner.y(), corner.x()) - middle;
        turn -= 2.0 * std::numbers::pi * std::floor(turn / (2.0 * std::numbers::pi) + 0.5);
        low = std::min(low, turn);
        high = std::max(high, turn);
    }
    return {middle + low, high - low};
}

}  // namespace

TriangleHeap TriangleHeap::from(const TerrainMesh& mesh) {
    std::vector<Triangle> triangles;
    triangles.reserve(mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const Lattice& lattice = mesh.resident->lattice();
        const auto place = [&](std::uint16_t index) {
            const std::int64_t column = index % kChunkSamples;
            const std::int64_t row = index / kChunkSamples;
            return WorldPos(lattice.x(chunk.corner.x + column * chunk.step),
                            lattice.y(chunk.corner.y + row * chunk.step),
                            lattice.quantum * chunk.heights[index]);
        };
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            const std::uint16_t* corner = mesh.indices.data() + part.first_index + i;
            triangles.push_back({place(corner[0]), place(corner[1]), place(corner[2])});
        }
    }
    return TriangleHeap(std::move(triangles));
}

TriangleHeap::TriangleHeap(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    std::vector<std::pair<int, std::uint32_t>> by_size;  // exponent of two
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
        const Triangle& t = triangles_[i];
        const Eigen::Vector3d low = t.a.cwiseMin(t.b).cwiseMin(t.c);
        const Eigen::Vector3d high = t.a.cwiseMax(t.b).cwiseMax(t.c);
        const double size = std::max(high.x() - low.x(), high.y() - low.y());
        by_size.emplace_back(size > 0.0 ? std::ilogb(size) + 1 : 0, i);
    }
    std::sort(by_size.begin(), by_size.end());
    for (std::size_t i = 0; i < by_size.size();) {
        Grid grid;
        grid.cell = std::ldexp(1.0, by_size[i].first);
        const int size = by_size[i].first;
        for (; i < by_size.size() && by_size[i].first == size; ++i) {
            const Triangle& t = triangles_[by_size[i].second];
            const Eigen::Vector3d low = t.a.cwiseMin(t.b).cwiseMin(t.c) / grid.cell;
            const Eigen::Vector3d high = t.a.cwiseMax(t.b).cwiseMax(t.c) / grid.cell;
            const auto east = static_cast<std::int64_t>(std::floor(high.x()));
            const auto north = static_cast<std::int64_t>(std::floor(high.y()));
            for (auto row = static_cast<std::int64_t>(std::floor(low.y())); row <= north; ++row) {
                for (auto column = static_cast<std::int64_t>(std::floor(low.x())); column <= east;
                     ++column) {
                    grid.entries.push_back({column, row, by_size[i].second});
                }
            }
        }
        std::sort(grid.entries.begin(), grid.entries.end(), [](const Entry& a, const Entry& b) {
            return std::tie(a.row, a.column, a.triangle) < std::tie(b.row, b.column, b.triangle);
        });
        grids_.push_back(std::move(grid));
    }
}

std::optional<double> TriangleHeap::height(double x, double y) const {
    std::optional<double> highest;
    for (const Grid& grid : grids_) {
        const auto column = static_cast<std::int64_t>(std::floor(x / grid.cell));
        const auto row = static_cast<std::int64_t>(std::floor(y / grid.cell));
        auto entry = std::lower_bound(
            grid.entries.begin(), grid.entries.end(), std::tie(row, column),
            [](const Entry& e, const auto& key) { return std::tie(e.row, e.column) < key; });
        for (; entry != grid.entries.end() && entry->row == row && entry->column == column;
             ++entry) {
            const Triangle& t = triangles_[entry->triangle];
            const double bx = t.b.x() - t.a.x(), by = t.b.y() - t.a.y();
            const double cx = t.c.x() - t.a.x(), cy = t.c.y() - t.a.y();
            const double px = x - t.a.x(), py = y - t.a.y();
            const double area = bx * cy - by * cx;
            if (area == 0.0) continue;
            const double u = (px * cy - py * cx) / area;
            const double v = (bx * py - by * px) / area;
            constexpr double kSlack = 1e-9;  // of a side: a point on an edge is in both triangles
            if (u < -kSlack || v < -kSlack || u + v > 1.0 + kSlack) continue;
            const double z = t.a.z() + u * (t.b.z() - t.a.z()) + v * (t.c.z() - t.a.z());
            highest = std::max(highest.value_or(z), z);
        }
    }
    return highest;
}

Verifier::Verifier(const HeightSource& source, std::size_t least_points)
    : source_(source), least_points_(least_points) {}

Measurement Verifier::measure(const TerrainMesh& mesh, const View& view) {
    return measure(TriangleHeap::from(mesh), view);
}

bool Verifier::is_ground(double x, double y) const {
    if (!source_.extent().contains(x, y)) return false;
    const Lattice& lattice = source_.lattice();
    SampleGrid cell;
    cell.corner = {static_cast<std::int64_t>(std::floor((x - lattice.origin_x) / lattice.spacing)),
                   static_cast<std::int64_t>(std::floor((y - lattice.origin_y) / lattice.spacing))};
    cell.columns = cell.rows = 2;
    std::uint8_t flags = 0;
    return source_.cell_flags(cell, {&flags, 1}) && (flags & cell_outside) == 0;
}

Measurement Verifier::measure(TriangleHeap heap, const View& view) {
    Measurement result;
    const Frustum frustum = make_frustum(view);
    std::optional<Frustum> frustum_before;
    if (before_) frustum_before = make_frustum(before_->view);
    const double moved = before_ ? (view.eye_world - before_->view.eye_world).norm() : 0.0;

    // Looks at one place; says whether it counts.
    const auto look_at = [&](double x, double y) {
        const double truth = source_.height(x, y);
        const WorldPos p_world(x, y, truth);
        if (!std::isfinite(truth)) return false;
        if (!is_inside(frustum, view.eye_world, p_world) || !is_ground(x, y)) return false;
        ++result.points;
        const double distance = (p_world - view.eye_world).norm();
        const std::optional<double> shown = heap.height(x, y);
        if (!shown) {
            ++result.holes;
            return true;
        }
        result.error_px =
            std::max(result.error_px, to_pixels(view, std::abs(*shown - truth), distance));
        if (before_ && is_inside(*frustum_before, before_->view.eye_world, p_world)) {
            if (const std::optional<double> was = before_->heap.height(x, y)) {
                const double pop = to_pixels(view, std::abs(*shown - *was), distance);
                double& most = moved < 0.1 * distance ? result.max_pop_px : result.max_near_pop_px;
                most = std::max(most, pop);
            }
        }
        return true;
    };

    // over the picture
    const WorldRect& extent = source_.extent();
    double farthest = 0.0;
    for (const double x : {extent.west, extent.east}) {
        for (const double y : {extent.south, extent.north}) {
            farthest =
                std::max(farthest, (Eigen::Vector2d(x, y) - view.eye_world.head<2>()).norm());
        }
    }
    const double ground = source_.height(view.eye_world.x(), view.eye_world.y());
    const double nearest =
        std::max(view.near_distance, 0.2 * std::abs(view.eye_world.z() - ground));
    const Wedge wedge = find_wedge(view, frustum);
    const double span = std::log(std::max(farthest, 2.0 * nearest) / nearest);
    const std::size_t most_tries = 4 * least_points_;
    for (std::size_t i = 1; i <= most_tries && 2 * result.points < least_points_; ++i) {
        const auto count = static_cast<double>(i);
        const double turn = wedge.first + wedge.span * fraction(kR2x * count);
        const double distance = nearest * std::exp(span * fraction(kR2y * count));
        look_at(view.eye_world.x() + distance * std::cos(turn),
                view.eye_world.y() + distance * std::sin(turn));
    }

    // over the triangles: several rounds where few of them are in view
    double sequence = 0.0;
    const double most_throws = 16.0 * static_cast<double>(least_points_);
    while (sequence < most_throws) {
        const std::size_t before_round = result.points;
        for (const TriangleHeap::Triangle& t : heap.triangles()) {
            sequence += 1.0;
            double u = fraction(kR2x * sequence);
            double v = fraction(kR2y * sequence);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            look_at(t.a.x() + u * (t.b.x() - t.a.x()) + v * (t.c.x() - t.a.x()),
                    t.a.y() + u * (t.b.y() - t.a.y()) + v * (t.c.y() - t.a.y()));
        }
        if (result.points >= least_points_ || result.points == before_round) break;
    }
    before_ = Frame{std::move(heap), view};
    return result;
}

}  // namespace terrane::tools
