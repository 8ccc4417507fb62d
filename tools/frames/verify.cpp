// SPDX-License-Identifier: MIT
// Sources: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (R2
//          sequence: fills a square evenly at any length).
#include "frames/verify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

// The part of the ground that a frame draws: its root squares.
WorldRect drawn_ground(const WorldRect& extent,
                       const std::shared_ptr<const ResidentSet>& resident) {
    if (resident == nullptr) return extent;
    const Lattice& window = resident->window();
    return {std::max(extent.west, window.x(window.west())),
            std::max(extent.south, window.y(window.south())),
            std::min(extent.east, window.x(window.east())),
            std::min(extent.north, window.y(window.north()))};
}

// The R2 sequence: fractional parts of the multiples of these.
constexpr double kR2x = 0.7548776662466927;
constexpr double kR2y = 0.5698402909980532;

// Points of volumes of a frame; cells of their index, in finest spacings; metres beyond which a displayed triangle is
// not searched for.
constexpr std::size_t kSolidPoints = 4000;
constexpr double kSolidCell = 4.0;
constexpr double kMostSearched = 20.0;

double fraction(double value) { return value - std::floor(value); }

// Range of horizontal directions inside the view: all of them where it contains the vertical.
struct Wedge {
    double first = 0.0, span = 2.0 * std::numbers::pi;  // radians from east
};

Wedge find_wedge(const View& view, bool holds_vertical) {
    if (holds_vertical) return {};
    // without the vertical the corner rays span less than half a turn around the view direction
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

Verifier::Camera::Camera(const View& of)
    : view(of), frustum(make_frustum(of)), pixels_per_radian(of.pixels_per_radian()) {}

bool Verifier::Camera::sees(const WorldPos& p_world) const {
    const Eigen::Vector3d displacement = p_world - view.eye_world;
    for (const Eigen::Vector3d& normal : frustum.normals) {
        if (normal.dot(displacement) < 0.0) return false;
    }
    return true;
}

double Verifier::Camera::to_pixels(double metres, const WorldPos& p_world) const {
    return metres * pixels_per_radian /
           std::max(view.near_distance, (p_world - view.eye_world).norm());
}

// Measures points one by one and keeps the maxima.
class Verifier::Points {
public:
    Points(const Verifier& verifier, const TriangleHeap& heap, const Camera& camera,
           double certified_px)
        : verifier_(verifier), heap_(heap), camera_(camera), certified_px_(certified_px) {
        if (const auto& before = verifier.before_) {
            moved_ = (camera.view.eye_world - before->camera.view.eye_world).norm();
        }
    }

    void add(double x, double y) {
        const double truth = verifier_.source_.height(x, y);
        const WorldPos p_world(x, y, truth);
        if (!std::isfinite(truth) || !camera_.sees(p_world) || !verifier_.is_ground(x, y) ||
            verifier_.is_replaced(x, y)) {
            return;
        }
        ++result.points;
        const std::optional<double> shown = heap_.height(x, y);
        if (!shown || !std::isfinite(*shown)) {
            ++result.holes;
            return;
        }
        result.error_px =
            std::max(result.error_px, camera_.to_pixels(std::abs(*shown - truth), p_world));
        const auto& before = verifier_.before_;
        if (!before || !before->camera.sees(p_world)) return;
        if (const std::optional<double> was = before->heap.height(x, y)) {
            count_movement(std::abs(*shown - *was), p_world);
        }
    }

    // Measures only the movement, at a vertex of one frame against the surface of the other.
    void add_vertex(const WorldPos& vertex, const TriangleHeap& other) {
        std::optional<double> height = other.vertex_height(vertex.x(), vertex.y());
        if (!height) height = other.height(vertex.x(), vertex.y());
        if (!height || *height == vertex.z()) return;
        const double truth = verifier_.source_.height(vertex.x(), vertex.y());
        const WorldPos p_world(vertex.x(), vertex.y(), truth);
        if (!std::isfinite(truth) || !camera_.sees(p_world) ||
            !verifier_.before_->camera.sees(p_world) ||
            !verifier_.is_ground(p_world.x(), p_world.y()) ||
            verifier_.is_replaced(p_world.x(), p_world.y())) {
            return;
        }
        count_movement(std::abs(*height - vertex.z()), p_world);
    }

    Measurement result;

private:
    void count_movement(double metres, const WorldPos& p_world) {
        const double distance = (p_world - camera_.view.eye_world).norm();
        const bool has_limit = certified_px_ <= kPopErrorLimit_px && moved_ < 0.1 * distance;
        double& most = has_limit ? result.max_pop_px : result.max_pop_elsewhere_px;
        most = std::max(most, camera_.to_pixels(metres, p_world));
    }

    const Verifier& verifier_;
    const TriangleHeap& heap_;
    const Camera& camera_;
    double certified_px_;
    double moved_ = 0.0;  // distance that the eye moved, metres
};

Verifier::Verifier(const HeightSource& source, std::size_t least_points)
    : source_(source), least_points_(least_points), drawn_(source.extent()) {}

Measurement Verifier::measure(const TerrainMesh& mesh, const View& view) {
    resident_ = mesh.resident;
    drawn_ = drawn_ground(source_.extent(), mesh.resident);
    const bool has_solids = resident_ != nullptr && !resident_->solids().empty();
    Measurement result = measure(TriangleHeap::from(mesh), view, mesh.error_px);
    if (has_solids) {
        const double spacing = resident_->lattice().spacing;
        before_->solids.emplace(mesh, kSolidCell * spacing);
        measure_solids(result);
    }
    return result;
}

// Whether volumes replace a triangle of the heightfield's cell at a place. A point on a border of cells belongs to all.
bool Verifier::is_replaced(double x, double y) const {
    if (resident_ == nullptr || resident_->solids().empty()) return false;
    const Lattice& lattice = resident_->lattice();
    const double column = (x - lattice.origin_x) / lattice.spacing;
    const double row = (y - lattice.origin_y) / lattice.spacing;
    constexpr double kSlack = 1e-6;  // cells
    for (const double to_x : {-kSlack, kSlack}) {
        for (const double to_y : {-kSlack, kSlack}) {
            const auto i = static_cast<std::int64_t>(std::floor(column + to_x));
            const auto j = static_cast<std::int64_t>(std::floor(row + to_y));
            const auto chunk_x =
                static_cast<std::int32_t>(std::floor(static_cast<double>(i) / kChunkCells));
            const auto chunk_y =
                static_cast<std::int32_t>(std::floor(static_cast<double>(j) / kChunkCells));
            const Chunk* const chunk = resident_->find_chunk(
                {chunk_x, chunk_y, static_cast<std::uint8_t>(lattice.finest_level)});
            if (chunk == nullptr || chunk->solid == nullptr) continue;
            const std::size_t cell =
                cell_index(static_cast<int>(i - std::int64_t{chunk_x} * kChunkCells),
                           static_cast<int>(j - std::int64_t{chunk_y} * kChunkCells));
            if (chunk->solid->is_replaced(cell, false) || chunk->solid->is_replaced(cell, true))
                return true;
        }
    }
    return false;
}

Eigen::Vector3d Verifier::displayed(const Frame& frame, const Eigen::Vector3d& p_world) {
    Eigen::Vector3d nearest = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    double least = nearest.x();
    if (const auto height = frame.heap.height(p_world.x(), p_world.y())) {
        nearest = {p_world.x(), p_world.y(), *height};
        least = std::abs(*height - p_world.z());
    }
    if (!frame.solids) return nearest;
    const Eigen::Vector3d in_solid = frame.solids->nearest(p_world, std::min(least, kMostSearched));
    return in_solid.allFinite() ? in_solid : nearest;
}

void Verifier::measure_solids(Measurement& result) const {
    const Frame& frame = *before_;
    const std::optional<Frame>& before = older_;
    std::size_t count = 0;
    for (const std::int32_t index : resident_->solids()) {
        count += resident_->chunks()[static_cast<std::size_t>(index)]
                     ->solid->triangles()
                     .triangles.size();
    }
    const std::size_t stride = std::max<std::size_t>(1, count / kSolidPoints);
    std::size_t next = 0;
    const auto measure_point = [&](const Eigen::Vector3d& p) {
        if (!frame.camera.sees(p)) return;
        const Eigen::Vector3d q = displayed(frame, p);
        ++result.solid_points;
        if (!q.allFinite()) {
            ++result.holes;
            return;
        }
        result.solid_error_px =
            std::max(result.solid_error_px, frame.camera.to_pixels((q - p).norm(), p));
        if (!before || !before->camera.sees(p)) return;
        const Eigen::Vector3d was = displayed(*before, p);
        if (!was.allFinite()) return;
        result.max_solid_pop_px =
            std::max(result.max_solid_pop_px, frame.camera.to_pixels((q - was).norm(), p));
    };
    for (const std::int32_t index : resident_->solids()) {
        const SolidTriangles& solid =
            resident_->chunks()[static_cast<std::size_t>(index)]->solid->triangles();
        for (; next < solid.triangles.size(); next += stride) {
            const auto& [a, b, c] = solid.triangles[next];
            const auto& v = solid.vertices_world;
            measure_point((v[a] + v[b] + v[c]) / 3.0);
        }
        next -= solid.triangles.size();
    }
    result.error_px = std::max(result.error_px, result.solid_error_px);
}

bool Verifier::is_ground(double x, double y) const {
    if (!drawn_.contains(x, y)) return false;
    const Lattice& lattice = source_.lattice();
    SampleGrid cell;
    cell.corner = {static_cast<std::int64_t>(std::floor((x - lattice.origin_x) / lattice.spacing)),
                   static_cast<std::int64_t>(std::floor((y - lattice.origin_y) / lattice.spacing))};
    cell.columns = cell.rows = 2;
    std::uint8_t flags = 0;
    return source_.cell_flags(cell, {&flags, 1}) && (flags & cell_outside) == 0;
}

void Verifier::sample_picture(const Camera& camera, Points& points) const {
    const View& view = camera.view;
    double farthest = 0.0;
    for (const double x : {drawn_.west, drawn_.east}) {
        for (const double y : {drawn_.south, drawn_.north}) {
            farthest =
                std::max(farthest, (Eigen::Vector2d(x, y) - view.eye_world.head<2>()).norm());
        }
    }
    const double ground = source_.height(view.eye_world.x(), view.eye_world.y());
    const double nearest =
        std::max(view.near_distance, 0.2 * std::abs(view.eye_world.z() - ground));
    const WorldPos vertical(0.0, 0.0, 1.0);
    const Wedge wedge = find_wedge(
        view, camera.sees(view.eye_world - vertical) || camera.sees(view.eye_world + vertical));
    const double span = std::log(std::max(farthest, 2.0 * nearest) / nearest);
    const std::size_t most_tries = 4 * least_points_;
    for (std::size_t i = 1; i <= most_tries && 2 * points.result.points < least_points_; ++i) {
        const auto count = static_cast<double>(i);
        const double turn = wedge.first + wedge.span * fraction(kR2x * count);
        const double distance = nearest * std::exp(span * fraction(kR2y * count));
        points.add(view.eye_world.x() + distance * std::cos(turn),
                   view.eye_world.y() + distance * std::sin(turn));
    }
}

// Repeats rounds over the triangles where few of them are in view; skips triangles where there are more of them than
// points.
void Verifier::sample_triangles(const TriangleHeap& heap, Points& points) const {
    const std::vector<TriangleHeap::Triangle>& triangles = heap.triangles();
    const std::size_t stride = std::max<std::size_t>(1, triangles.size() / (2 * least_points_));
    const std::size_t most_tries = 16 * least_points_;
    std::size_t tried = 0;
    for (std::size_t round = 0; tried < most_tries; ++round) {
        const std::size_t before_round = points.result.points;
        for (std::size_t i = round % stride; i < triangles.size(); i += stride) {
            const TriangleHeap::Triangle& t = triangles[i];
            const auto count = static_cast<double>(++tried);
            double u = fraction(kR2x * count);
            double v = fraction(kR2y * count);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            points.add(t.a.x() + u * (t.b.x() - t.a.x()) + v * (t.c.x() - t.a.x()),
                       t.a.y() + u * (t.b.y() - t.a.y()) + v * (t.c.y() - t.a.y()));
        }
        if (points.result.points >= least_points_) break;
        if (points.result.points == before_round && round + 1 >= stride) break;
    }
}

Measurement Verifier::measure(TriangleHeap heap, const View& view, double certified_px) {
    const Camera camera(view);
    Points points(*this, heap, camera, certified_px);
    sample_picture(camera, points);
    sample_triangles(heap, points);
    if (before_) {
        for (const WorldPos& vertex : heap.vertices()) points.add_vertex(vertex, before_->heap);
        for (const WorldPos& vertex : before_->heap.vertices()) points.add_vertex(vertex, heap);
    }
    const Measurement result = points.result;
    older_ = std::move(before_);
    before_ = Frame{std::move(heap), camera, std::nullopt};
    return result;
}

}  // namespace terrane::tools
