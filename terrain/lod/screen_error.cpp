// SPDX-License-Identifier: MIT
#include "lod/screen_error.h"

#include "chunk/chunk_vertices.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

struct Step {
    int column, row;
};
constexpr std::array<Step, 4> kSteps{Step{-1, 0}, Step{1, 0}, Step{0, -1}, Step{0, 1}};

bool is_inside(int column, int row) {
    return column >= 0 && row >= 0 && column < kChunkAreas && row < kChunkAreas;
}

}  // namespace

AreaRef adjacent_area(const OpenChunk& chunk, int area, Side side) {
    const int column = area % kChunkAreas + kSteps[side].column;
    const int row = area / kChunkAreas + kSteps[side].row;
    const auto wrap = [](int i) { return (i + kChunkAreas) % kChunkAreas; };
    return {is_inside(column, row) ? &chunk : chunk.neighbour[side],
            wrap(row) * kChunkAreas + wrap(column)};
}

bool is_world_border(const OpenChunk& chunk, int area, Side side) {
    const int column = area % kChunkAreas + kSteps[side].column;
    const int row = area / kChunkAreas + kSteps[side].row;
    return !is_inside(column, row) && chunk.at_world_border[side];
}

float OpenChunk::key_at(int column, int row) const {
    const auto of_square = [](int sample) { return static_cast<std::size_t>(sample / 2); };
    if (((column | row) & 1) == 0) {
        return is_root() ? coarse_key(column, row) : kNever;
    }
    if (column == kChunkCells && at_world_border[east]) return east_keys[of_square(row)];
    if (row == kChunkCells && at_world_border[north]) return north_keys[of_square(column)];
    const OpenChunk* owner = this;
    if (column == kChunkCells || row == kChunkCells) {
        owner = neighbour[column == kChunkCells ? east : north];
        if (owner == nullptr) return kNever;
    }
    const auto [area, kind, square] =
        AreaVertices::address_of(column % kChunkCells, row % kChunkCells);
    return owner->is_open(static_cast<int>(area)) ? owner->keys[area].of[kind][square] : kNever;
}

float OpenChunk::side_rise(Side side, int at, float quantum) const {
    if (!at_world_border[side]) {
        const auto [area, kind, square] =
            side == east ? AreaVertices::address_of(0, at) : AreaVertices::address_of(at, 0);
        const AreaVertices& vertices = neighbour[side]->chunk->vertices->areas[area];
        return vertices.rise_unit * static_cast<float>(vertices.rise[kind][square]);
    }
    const auto height = [&](int i) {
        return chunk
            ->heights[side == east ? sample_index(kChunkCells, i) : sample_index(i, kChunkCells)];
    };
    return 0.5f * quantum *
           (static_cast<float>(height(at) - height(at - 1)) +
            static_cast<float>(height(at) - height(at + 1)));
}

namespace {

using Line = std::array<float, AreaVertices::kSquares>;
constexpr Line filled(float key) {
    Line line{};
    for (float& value : line) value = key;
    return line;
}
// Keys of absent parents, which exclude the children, of parents that are not below the floor, and of parents beyond
// the world's border, which exclude nothing.
constexpr Line kAbsent = filled(OpenChunk::kNever);
constexpr Line kAboveFloor = filled(OpenChunk::kAboveFloor);
constexpr Line kNothing = filled(0.0f);

const float* adjacent_keys(const OpenChunk& chunk, int area, Side side, AreaVertices::Kind kind) {
    const AreaRef adjacent = adjacent_area(chunk, area, side);
    if (adjacent.chunk == nullptr) return kAbsent.data();
    return adjacent.is_open() ? adjacent.chunk->keys_of(adjacent.area)[kind].data()
                              : kAboveFloor.data();
}

}  // namespace

const float* adjacent_centres(const OpenChunk& chunk, int area, Side side) {
    if (is_world_border(chunk, area, side)) return kNothing.data();
    return adjacent_keys(chunk, area, side, AreaVertices::centre);
}

CentreParents::CentreParents(const OpenChunk& chunk, int area) {
    sides_.north = sides_.east = kAbsent.data();
    if (chunk.is_root()) {
        gather(chunk, area);
    } else {
        find(chunk, area);
    }
}

void CentreParents::gather(const OpenChunk& root, int area) {
    const auto west = static_cast<std::size_t>(area % kChunkAreas * kAreaSquares);
    const auto south = static_cast<std::size_t>(area / kChunkAreas * kAreaSquares);
    const auto at = [&](std::size_t column, std::size_t row) {
        return root.coarse_keys[(south + row) * OpenChunk::kCoarseSide + west + column];
    };
    constexpr std::size_t kHalf = kAreaSquares / 2;
    for (std::size_t j = 0; j <= kHalf; ++j) {
        for (std::size_t i = 0; i <= kHalf; ++i) {
            const std::size_t square = j * kAreaSquares + i;
            along_x_[square] = i < kHalf ? at(2 * i + 1, 2 * j) : OpenChunk::kNever;
            along_y_[square] = j < kHalf ? at(2 * i, 2 * j + 1) : OpenChunk::kNever;
        }
        for (std::size_t i = kHalf + 1; i < kAreaSquares; ++i) {
            along_x_[j * kAreaSquares + i] = along_y_[j * kAreaSquares + i] = OpenChunk::kNever;
        }
    }
    sides_.along_x = along_x_.data();
    sides_.along_y = along_y_.data();
}

void CentreParents::find(const OpenChunk& chunk, int area) {
    const OpenChunk& parent = *chunk.parent;
    const ChunkKey& key = chunk.chunk->key;
    const int shift_x = (key.x & 1) != 0 ? kChunkAreas / 2 : 0;
    const int shift_y = (key.y & 1) != 0 ? kChunkAreas / 2 : 0;
    const int column = area % kChunkAreas, row = area / kChunkAreas;
    const int above = (shift_y + row / 2) * kChunkAreas + shift_x + column / 2;
    sides_.column = column % 2 * (kAreaSquares / 2);
    sides_.row = row % 2 * (kAreaSquares / 2);
    sides_.along_x = sides_.along_y = kAboveFloor.data();
    if (parent.is_open(above)) {
        sides_.along_x = parent.keys_of(above)[AreaVertices::along_x].data();
        sides_.along_y = parent.keys_of(above)[AreaVertices::along_y].data();
    }
    if (sides_.row != 0) {
        sides_.north =
            is_world_border(parent, above, north)
                ? &parent.north_keys[static_cast<std::size_t>(above % kChunkAreas * kAreaSquares)]
                : adjacent_keys(parent, above, north, AreaVertices::along_x);
    }
    if (sides_.column != 0 && is_world_border(parent, above, east)) {
        const auto first = static_cast<std::size_t>(above / kChunkAreas * kAreaSquares);
        along_y_ = kAbsent;
        for (std::size_t i = 0; i < kAreaSquares; ++i) {
            along_y_[i * kAreaSquares] = parent.east_keys[first + i];
        }
        sides_.east = along_y_.data();
    } else if (sides_.column != 0) {
        sides_.east = adjacent_keys(parent, above, east, AreaVertices::along_y);
    }
}

// Nested screen errors.
// Sources:
//   P. Lindstrom, V. Pascucci. Terrain Simplification Simplified: A General Framework for
//   View-Dependent Out-of-Core Visualization. IEEE TVCG 8(3), 2002. (nested errors and radii)
// Deviations: nested boxes instead of spheres, so that steep ground extends them in height only; their widths are
//             constant per level, their heights follow the ground; errors are certified bounds, not measured at the
//             midpoint; keys are inverse squares, which need neither square root nor division.
//
// Widths of boxes. From a centre of spacing s, the midpoints of its square are at a distance s along one axis; from a
// midpoint of spacing s, the centres of spacing s / 2 are at s / 2 along both axes. So half the width of a centre's box
// is s + s / 2 + (s + s / 2) / 2 + ... = 3 s, and half the width of a midpoint's box s / 2 + 3 s / 2 = 2 s.

namespace {

// Margin for the rounding of positions to single precision.
constexpr double kWider = 1.0 + 0x1p-20;
// Factor on lower bounds of keys, for the rounding of keys.
constexpr double kKeyMargin = 0.9999;
// Coordinates are clamped to this, metres, so that their squares stay finite.
constexpr double kFarthest = 1e16;

float round_up(double value) {
    const auto rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value
               ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
               : rounded;
}

float round_down(double value) { return -round_up(-value); }

float clamped(double metres) {
    return static_cast<float>(std::clamp(metres, -kFarthest, kFarthest));
}

// Support point of a box in a direction.
Eigen::Vector3d support(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                        const Eigen::Vector3d& along) {
    return {along.x() > 0.0 ? high.x() : low.x(), along.y() > 0.0 ? high.y() : low.y(),
            along.z() > 0.0 ? high.z() : low.z()};
}

ScreenError::WorldBox widened(const ScreenError::WorldBox& samples, const HeightInterval& heights,
                              float half_width) {
    const auto margin = static_cast<double>(half_width);
    return {{samples.low.x() - margin, samples.low.y() - margin, heights.low},
            {samples.high.x() + margin, samples.high.y() + margin, heights.high}};
}

}  // namespace

Reaches make_reaches(const HeightSource& source) {
    const Lattice& lattice = source.lattice();
    Reaches reaches;
    for (int exponent = 0; exponent < lattice.finest_level + 8; ++exponent) {
        const double spacing = std::ldexp(lattice.spacing, exponent);
        const ReachHeights up = reach_heights(source, spacing);
        reaches.midpoint.push_back(
            {round_up(2.0 * spacing * kWider), round_up(up.of_midpoint * kWider)});
        reaches.centre.push_back(
            {round_up(3.0 * spacing * kWider), round_up(up.of_centre * kWider)});
    }
    return reaches;
}

double clearance_of(const HeightSource& source, const WorldPos& eye) {
    const auto gap = [&](double around) {
        const HeightInterval heights = source.interval(
            {eye.x() - around, eye.y() - around, eye.x() + around, eye.y() + around});
        // an empty or invalid interval gives no bound
        const bool is_known = heights.low <= heights.high && heights.low <= kMostHeight &&
                              heights.high >= -kMostHeight;
        return is_known ? std::max(heights.low - eye.z(), eye.z() - heights.high) : 0.0;
    };
    constexpr int kTries = 12;
    constexpr double kSmaller = 0.75;
    double clearance = 0.0;
    // outside the square the true surface is farther away than half the square's side
    double around = gap(0.0);
    for (int i = 0; i < kTries && around > clearance; ++i, around *= kSmaller) {
        const double inside = gap(around);
        if (inside > clearance) clearance = std::min(inside, around);
    }
    return clearance * (1.0 - 1e-9);
}

ScreenError::ScreenError(const View& view, const HeightSource& source, double clearance)
    : lattice_(source.lattice()),
      eye_(view.eye_world),
      near_(view.near_distance),
      clearance_(clearance),
      pixels_(view.pixels_per_radian()),
      frustum_(make_frustum(view)) {
    near_squared_ =
        std::max(round_down(std::min(near_ * near_, 1e30)), std::numeric_limits<float>::min());
}

float ScreenError::key_of(double error_px) const {
    const double ratio = pixels_ / error_px;
    return static_cast<float>(
        std::min(ratio * ratio, static_cast<double>(std::numeric_limits<float>::max())));
}

double ScreenError::error_px_of(float key) const {
    return pixels_ / std::sqrt(static_cast<double>(key));
}

double ScreenError::error_px_at(double bound, double distance) const {
    return bound * pixels_ / std::max(least_distance(), distance);
}

float ScreenError::height_over_eye(double height) const { return clamped(height - eye_.z()); }

EyeHeights ScreenError::eye_heights(const Chunk& chunk) const {
    return {chunk.vertices->reach_unit, height_over_eye(chunk.vertices->reach_base), near_squared_};
}

void ScreenError::fill_axes(const Chunk& chunk, ChunkAxes& axes_out) const {
    const auto fill = [&](double origin, double eye, std::int64_t corner, ChunkAxes::Axis& axis) {
        // as Lattice::x() and y()
        const auto from_eye = [&](std::int64_t index) {
            return clamped(origin + lattice_.spacing * static_cast<double>(index) - eye);
        };
        const std::int64_t two_steps = 2 * chunk.step;
        std::int64_t even = corner, odd = corner + chunk.step;
        for (float& position : axis.even) {
            position = from_eye(even);
            even += two_steps;
        }
        for (float& position : axis.odd) {
            position = from_eye(odd);
            odd += two_steps;
        }
    };
    fill(lattice_.origin_x, eye_.x(), chunk.corner.x, axes_out.x);
    fill(lattice_.origin_y, eye_.y(), chunk.corner.y, axes_out.y);
}

ScreenError::WorldBox ScreenError::box_of(const Chunk& chunk) const {
    const std::int64_t side = chunk.step * kChunkCells;
    return {{lattice_.x(chunk.corner.x), lattice_.y(chunk.corner.y), lattice_.quantum * chunk.low},
            {lattice_.x(chunk.corner.x + side), lattice_.y(chunk.corner.y + side),
             lattice_.quantum * chunk.high}};
}

ScreenError::WorldBox ScreenError::box_of_area(const Chunk& chunk, int area) const {
    const Chunk::Area& part = chunk.areas[static_cast<std::size_t>(area)];
    const std::int64_t west = chunk.corner.x + area % kChunkAreas * kAreaCells * chunk.step;
    const std::int64_t south = chunk.corner.y + area / kChunkAreas * kAreaCells * chunk.step;
    const std::int64_t side = kAreaCells * chunk.step;
    return {{lattice_.x(west), lattice_.y(south), lattice_.quantum * part.low},
            {lattice_.x(west + side), lattice_.y(south + side), lattice_.quantum * part.high}};
}

std::uint64_t ScreenError::areas_below(const Chunk& chunk, float half_width, float floor,
                                       bool is_in_view) const {
    // horizontal gaps between the eye and the reaches of a column or row of areas
    const auto margin = static_cast<double>(half_width);
    std::array<double, kChunkAreas> x_squared, y_squared;
    const auto gap_squared = [&](double low, double high, double eye) {
        const double gap = std::max({low - margin - eye, eye - high - margin, 0.0});
        return gap * gap;
    };
    for (int i = 0; i < kChunkAreas; ++i) {
        const std::int64_t from = i * kAreaCells * chunk.step;
        const std::int64_t to = from + kAreaCells * chunk.step;
        const auto k = static_cast<std::size_t>(i);
        x_squared[k] = gap_squared(lattice_.x(chunk.corner.x + from),
                                   lattice_.x(chunk.corner.x + to), eye_.x());
        y_squared[k] = gap_squared(lattice_.y(chunk.corner.y + from),
                                   lattice_.y(chunk.corner.y + to), eye_.y());
    }
    std::uint64_t areas = 0;
    for (int area = 0; area < kChunkAreas * kChunkAreas; ++area) {
        const double bound = chunk.areas[static_cast<std::size_t>(area)].max_vertex_bound;
        const HeightInterval heights = chunk.vertices->reach_of_area(area);
        const double gap = std::max({heights.low - eye_.z(), eye_.z() - heights.high, 0.0});
        const double distance_squared = x_squared[static_cast<std::size_t>(area % kChunkAreas)] +
                                        y_squared[static_cast<std::size_t>(area / kChunkAreas)] +
                                        gap * gap;
        // the key in view; outside the view keys are larger
        if (!(kKeyMargin * std::max(distance_squared, near_ * near_) <
              static_cast<double>(floor) * bound * bound)) {
            continue;
        }
        if (!is_in_view && !(least_key(reach_of_area(chunk, area, half_width),
                                       static_cast<float>(bound)) < floor)) {
            continue;
        }
        areas |= std::uint64_t{1} << area;
    }
    return areas;
}

bool ScreenError::may_be_below(const WorldBox& reach, float largest_bound, float floor) const {
    // the key in view; outside the view keys are larger
    const auto bound = static_cast<double>(largest_bound);
    return kKeyMargin * std::max(distance_squared(reach), near_ * near_) <
               static_cast<double>(floor) * bound * bound &&
           least_key(reach, largest_bound) < floor;
}

double ScreenError::distance_squared(const WorldBox& box) const {
    return (box.low - eye_)
        .cwiseMax(eye_ - box.high)
        .cwiseMax(Eigen::Vector3d::Zero())
        .squaredNorm();
}

float ScreenError::least_key(const WorldBox& reach, float largest_bound) const {
    const Eigen::Vector3d low = reach.low - eye_;
    const Eigen::Vector3d high = reach.high - eye_;
    double beside = 0.0;
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        beside = std::max(beside, -normal.dot(support(low, high, normal)));
    }
    const double farthest = low.cwiseAbs().cwiseMax(high.cwiseAbs()).sum() + near_;
    const double weight = std::max(1.0 - static_cast<double>(kWeightSlope) * beside / farthest,
                                   static_cast<double>(kLeastWeight));
    const double bound = static_cast<double>(largest_bound);
    const double key = kKeyMargin * std::max(distance_squared(reach), near_ * near_) /
                       std::max(bound * bound * weight * weight,
                                static_cast<double>(std::numeric_limits<float>::min()));
    return static_cast<float>(
        std::min(key, static_cast<double>(std::numeric_limits<float>::max())));
}

ScreenError::WorldBox ScreenError::reach_of(const Chunk& chunk, float half_width) const {
    return widened(box_of(chunk), chunk.vertex_reach, half_width);
}

ScreenError::WorldBox ScreenError::reach_of_area(const Chunk& chunk, int area,
                                                 float half_width) const {
    return widened(box_of_area(chunk, area), chunk.vertices->reach_of_area(area), half_width);
}

KeyPlanes ScreenError::planes_across(const WorldBox& box) const {
    KeyPlanes planes;
    planes.near_distance = static_cast<float>(near_);
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        if (normal.dot(support(box.low, box.high, -normal) - eye_) >= 0.0) continue;
        planes.x[planes.count] = static_cast<float>(normal.x());
        planes.y[planes.count] = static_cast<float>(normal.y());
        planes.z[planes.count] = static_cast<float>(normal.z());
        ++planes.count;
    }
    return planes;
}

bool ScreenError::is_inside(const WorldBox& box) const {
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        if (normal.dot(support(box.low, box.high, -normal) - eye_) < 0.0) return false;
    }
    return true;
}

double ScreenError::error_in_view(const WorldBox& box, double bound) const {
    const Eigen::Vector3d low = box.low - eye_;
    const Eigen::Vector3d high = box.high - eye_;
    const double slack = 1e-9 * (low.cwiseAbs().maxCoeff() + high.cwiseAbs().maxCoeff());
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        if (normal.dot(support(low, high, normal)) < -slack) return 0.0;
    }
    const double distance = low.cwiseMax(-high).cwiseMax(Eigen::Vector3d::Zero()).norm();
    return error_px_at(bound, distance * (1.0 - 1e-12)) * (1.0 + 1e-12);
}

double ScreenError::error_in_view(const Triangle& triangle, double bound) const {
    // clips the triangle to the region where the surface within `bound` of it may be in view (Sutherland-Hodgman)
    std::array<Eigen::Vector3d, 8> part, next;
    std::size_t count = 3;
    double farthest = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        part[i] = triangle[i] - eye_;
        farthest = std::max(farthest, part[i].cwiseAbs().maxCoeff());
    }
    const double slack = 1e-9 * (farthest + bound);
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        const double least = -std::abs(normal.z()) * bound - slack;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d& a = part[i];
            const Eigen::Vector3d& b = part[i + 1 < count ? i + 1 : 0];
            const double above_a = normal.dot(a) - least, above_b = normal.dot(b) - least;
            if (above_a >= 0.0) next[kept++] = a;
            if ((above_a >= 0.0) != (above_b >= 0.0)) {
                next[kept++] = a + above_a / (above_a - above_b) * (b - a);
            }
        }
        if (kept == 0) return 0.0;
        std::swap(part, next);
        count = kept;
    }
    Eigen::Vector3d low = part[0], high = part[0];
    for (std::size_t i = 1; i < count; ++i) {
        low = low.cwiseMin(part[i]);
        high = high.cwiseMax(part[i]);
    }
    low.z() -= bound;
    high.z() += bound;
    const double distance = low.cwiseMax(-high).cwiseMax(Eigen::Vector3d::Zero()).norm();
    return error_px_at(bound, std::max(distance - slack, 0.0)) * (1.0 + 1e-12);
}

}  // namespace terrane::internal
