// SPDX-License-Identifier: MIT
#include "frames/verification.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace terrane::tools {
namespace {

std::uint64_t hash(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    std::uint64_t h = a * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 32) ^ b) * 0xc2b2ae3d27d4eb4fu;
    h = (h ^ (h >> 29) ^ c) * 0xff51afd7ed558ccdu;
    return h ^ (h >> 32);
}

std::int64_t cell_of(double value, double cell) {
    return static_cast<std::int64_t>(std::floor(value / cell));
}

// Index of the list for a cell in the grid of one size class. The lists of a block of 8 x 8 cells are adjacent in
// memory, because queries are spatially coherent.
std::size_t list_of(std::size_t size, std::int64_t column, std::int64_t row, std::size_t mask) {
    const std::uint64_t square =
        hash(size, static_cast<std::uint64_t>(column >> 3), static_cast<std::uint64_t>(row >> 3));
    const auto cell = static_cast<std::uint64_t>(((row & 7) << 3) | (column & 7));
    return static_cast<std::size_t>((square << 6) | cell) & mask;
}

std::size_t hash_of(double x, double y) {
    return static_cast<std::size_t>(
        hash(std::bit_cast<std::uint64_t>(x), std::bit_cast<std::uint64_t>(y), 0));
}

// Size class of a triangle: exponent of the least power of two above the sides of its bounding rectangle.
int size_of(const TriangleHeap::Triangle& t) {
    const auto [west, east] = std::minmax({t.a.x(), t.b.x(), t.c.x()});
    const auto [south, north] = std::minmax({t.a.y(), t.b.y(), t.c.y()});
    const double side = std::max(east - west, north - south);
    return side > 0.0 ? std::ilogb(side) + 1 : 0;
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
                            part.displayed_height(index, lattice.quantum));
        };
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            const std::uint16_t* corner = mesh.indices.data() + part.first_index + i;
            triangles.push_back({place(corner[0]), place(corner[1]), place(corner[2])});
        }
    }
    return TriangleHeap(std::move(triangles));
}

TriangleHeap::TriangleHeap(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    list_triangles();
    list_vertices();
}

// Counts the entries of each list, then fills them.
void TriangleHeap::list_triangles() {
    std::vector<int> exponents;
    for (const Triangle& t : triangles_) {
        const int exponent = size_of(t);
        if (std::find(exponents.begin(), exponents.end(), exponent) == exponents.end()) {
            exponents.push_back(exponent);
        }
    }
    std::sort(exponents.begin(), exponents.end());
    for (const int exponent : exponents) cells_.push_back(std::ldexp(1.0, exponent));

    const std::size_t list_count = std::bit_ceil(2 * triangles_.size() + 1);
    const auto for_all_entries = [&](auto use) {
        for (std::size_t i = 0; i < triangles_.size(); ++i) {
            const Triangle& t = triangles_[i];
            const auto size = static_cast<std::size_t>(
                std::lower_bound(exponents.begin(), exponents.end(), size_of(t)) -
                exponents.begin());
            const double cell = cells_[size];
            const auto [west, east] = std::minmax({t.a.x(), t.b.x(), t.c.x()});
            const auto [south, north] = std::minmax({t.a.y(), t.b.y(), t.c.y()});
            for (std::int64_t row = cell_of(south, cell); row <= cell_of(north, cell); ++row) {
                for (std::int64_t column = cell_of(west, cell); column <= cell_of(east, cell);
                     ++column) {
                    use(list_of(size, column, row, list_count - 1), static_cast<std::uint32_t>(i));
                }
            }
        }
    };
    first_.assign(list_count + 2, 0);
    for_all_entries([&](std::size_t list, std::uint32_t) { ++first_[list + 2]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    lists_.resize(first_.back());
    for_all_entries(
        [&](std::size_t list, std::uint32_t triangle) { lists_[first_[list + 1]++] = triangle; });
    first_.pop_back();
}

void TriangleHeap::list_vertices() {
    table_.assign(std::bit_ceil(6 * triangles_.size() + 1), kNone);
    for (const Triangle& t : triangles_) {
        for (const WorldPos* corner : {&t.a, &t.b, &t.c}) {
            const std::size_t at = find_slot(corner->x(), corner->y());
            if (table_[at] != kNone) continue;
            table_[at] = static_cast<std::uint32_t>(vertices_.size());
            vertices_.push_back(*corner);
        }
    }
}

std::size_t TriangleHeap::find_slot(double x, double y) const {
    const std::size_t mask = table_.size() - 1;
    for (std::size_t at = hash_of(x, y) & mask;; at = (at + 1) & mask) {
        if (table_[at] == kNone) return at;
        const WorldPos& known = vertices_[table_[at]];
        if (known.x() == x && known.y() == y) return at;
    }
}

std::optional<double> TriangleHeap::vertex_height(double x, double y) const {
    const std::uint32_t vertex = table_[find_slot(x, y)];
    return vertex == kNone ? std::nullopt : std::optional<double>(vertices_[vertex].z());
}

std::optional<double> TriangleHeap::height(double x, double y) const {
    std::optional<double> highest;
    const std::size_t mask = first_.size() - 2;
    for (std::size_t size = 0; size < cells_.size(); ++size) {
        const std::size_t list =
            list_of(size, cell_of(x, cells_[size]), cell_of(y, cells_[size]), mask);
        for (std::uint32_t i = first_[list]; i < first_[list + 1]; ++i) {
            const Triangle& t = triangles_[lists_[i]];
            const double bx = t.b.x() - t.a.x(), by = t.b.y() - t.a.y();
            const double cx = t.c.x() - t.a.x(), cy = t.c.y() - t.a.y();
            const double px = x - t.a.x(), py = y - t.a.y();
            const double area = bx * cy - by * cx;
            if (area == 0.0) continue;
            const double u = (px * cy - py * cx) / area;
            const double v = (bx * py - by * px) / area;
            constexpr double kSlack = 1e-9;  // relative: a point on an edge is in both triangles
            if (u < -kSlack || v < -kSlack || u + v > 1.0 + kSlack) continue;
            const double z = t.a.z() + u * (t.b.z() - t.a.z()) + v * (t.c.z() - t.a.z());
            highest = std::max(highest.value_or(z), z);
        }
    }
    return highest;
}

// Sources: C. Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (nearest point of a triangle).

namespace {

Eigen::Vector3d nearest_in_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = b - a;
    const double square = along.squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0.0;
    return a + t * along;
}

}  // namespace

Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double square = normal.squaredNorm();
    if (square > 0.0 && (b - a).cross(p - a).dot(normal) >= 0.0 &&
        (c - b).cross(p - b).dot(normal) >= 0.0 && (a - c).cross(p - c).dot(normal) >= 0.0) {
        return p - (p - a).dot(normal) / square * normal;
    }
    const Eigen::Vector3d of_edges[] = {nearest_in_segment(p, a, b), nearest_in_segment(p, b, c),
                                        nearest_in_segment(p, c, a)};
    return *std::ranges::min_element(
        of_edges, {}, [&](const Eigen::Vector3d& q) { return (q - p).squaredNorm(); });
}

std::size_t SolidHeap::CellHash::operator()(const Cell& cell) const {
    std::uint64_t h = 0;
    for (const std::int64_t i : cell) {
        h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(i)) * 0x9e3779b97f4a7c15u;
    }
    return static_cast<std::size_t>(h ^ (h >> 32));
}

SolidHeap::Cell SolidHeap::cell_of(const Eigen::Vector3d& p) const {
    Cell cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        cell[axis] =
            static_cast<std::int64_t>(std::floor(p[static_cast<Eigen::Index>(axis)] / cell_));
    }
    return cell;
}

SolidHeap::SolidHeap(const TerrainMesh& mesh, double cell) : cell_(cell) {
    for (const MeshSolid& drawn : mesh.solids) {
        const SolidTriangles& solid = drawn.chunk->solid->triangles();
        add(solid, drawn.triangles);
        for (const MeshSolid::Triangles& cap : drawn.caps) add(solid, cap);
    }
}

void SolidHeap::add(const SolidTriangles& solid, MeshSolid::Triangles triangles) {
    for (const auto& [a, b, c] : triangles) {
        const auto index = static_cast<std::uint32_t>(triangles_.size());
        const Triangle& t = triangles_.emplace_back(
            Triangle{solid.vertices_world[a], solid.vertices_world[b], solid.vertices_world[c]});
        const Cell low = cell_of(t[0].cwiseMin(t[1]).cwiseMin(t[2]));
        const Cell high = cell_of(t[0].cwiseMax(t[1]).cwiseMax(t[2]));
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
            for (std::int64_t y = low[1]; y <= high[1]; ++y) {
                for (std::int64_t x = low[0]; x <= high[0]; ++x) {
                    cells_[{x, y, z}].push_back(index);
                }
            }
        }
    }
}

Eigen::Vector3d SolidHeap::nearest(const Eigen::Vector3d& p_world, double most) const {
    Eigen::Vector3d best = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    double least = most;
    const Cell middle = cell_of(p_world);
    // searches shells of cells around the point: shell i contains no point nearer than i - 1 cells
    for (std::int64_t i = 0; cell_ * static_cast<double>(i - 1) <= least; ++i) {
        for (std::int64_t z = -i; z <= i; ++z) {
            for (std::int64_t y = -i; y <= i; ++y) {
                const bool is_face = std::abs(z) == i || std::abs(y) == i;
                for (std::int64_t x = -i; x <= i;
                     x += is_face ? 1 : std::max<std::int64_t>(1, 2 * i)) {
                    const auto found = cells_.find({middle[0] + x, middle[1] + y, middle[2] + z});
                    if (found == cells_.end()) continue;
                    for (const std::uint32_t t : found->second) {
                        const Triangle& triangle = triangles_[t];
                        const Eigen::Vector3d q =
                            nearest_in_triangle(p_world, triangle[0], triangle[1], triangle[2]);
                        const double distance = (q - p_world).norm();
                        if (distance > least) continue;
                        least = distance;
                        best = q;
                    }
                }
            }
        }
    }
    return best;
}

// Sources: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (R2
//          sequence: fills a square evenly at any length).

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

// The R2 sequence: the fractional parts of the multiples of these constants.
constexpr double kR2x = 0.7548776662466927;
constexpr double kR2y = 0.5698402909980532;

// Points measured on volumes in a frame; cell side of the index of their triangles, in finest spacings; radius in which
// displayed triangles are searched, metres.
constexpr std::size_t kSolidPoints = 4000;
constexpr double kSolidCell = 4.0;
constexpr double kMostSearched = 20.0;

double fraction(double value) { return value - std::floor(value); }

// Range of the horizontal directions inside a view: all of them if the view contains the vertical.
struct Wedge {
    double first = 0.0, span = 2.0 * std::numbers::pi;  // radians from east
};

Wedge find_wedge(const View& view, bool holds_vertical) {
    if (holds_vertical) return {};
    // if the view does not contain the vertical, its corner rays span less than half a turn around the view direction
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

// Measures points one by one, and keeps the largest errors and movements.
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

    // Measures only movement, at a vertex of one frame against the surface of the other.
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

// Whether volumes replace a triangle of the heightfield in the cell at a position. A position on a border belongs to
// all adjacent cells.
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

// Samples triangles in rounds until there are enough points. If there are many more triangles, a round skips some.
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
