// SPDX-License-Identifier: MIT
//
// Source: R. Cook. Stochastic Sampling in Computer Graphics. ACM Transactions on Graphics 5(1), 1986 (jittered
//         sampling).
#include "base/settings_check.h"
#include "base/vector_math.h"
#include "source/fractal/noise.h"

#include <terrane/base/text.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/scatter.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

namespace terrane {
namespace {

constexpr double kMostPerKm2 = 1e6;
constexpr double kSquareMetresPerKm2 = 1e6;
constexpr double kMostInCell = 4096.0;

double squared_tangent_of(double slope) {
    if (slope >= 0.5 * std::numbers::pi) return internal::kInfinity;
    const double tangent = internal::tangent(slope);
    return tangent * tangent;
}

// The sequence of random numbers of one candidate.
class CandidateNumbers {
public:
    CandidateNumbers(std::uint64_t seed, std::int64_t column, std::int64_t row, int candidate)
        : state_(mix64(mix64(mix64(seed) + static_cast<std::uint64_t>(column)) ^
                       static_cast<std::uint64_t>(row)) +
                 static_cast<std::uint64_t>(candidate)) {}

    /// In [0, 1).
    double next() {
        state_ += 0x9e3779b97f4a7c15u;
        return static_cast<double>(mix64(state_) >> 11) * 0x1p-53;
    }

private:
    std::uint64_t state_;
};

// Height and gradient at a position in a cell, on the triangle that contains it; cells are cut as in chunks.
struct CellPlane {
    double height = 0.0, slope_x = 0.0, slope_y = 0.0;

    /// @param z heights: south-west, south-east, north-west, north-east
    /// @param u, v  position, 0 to 1 from the south-west corner
    CellPlane(const std::array<double, 4>& z, bool is_cut_to_north_east, double u, double v,
              double side) {
        double along_x = 0.0, along_y = 0.0;
        if (is_cut_to_north_east ? u >= v : u + v <= 1.0) {
            // the southern triangle
            along_x = z[1] - z[0];
            along_y = is_cut_to_north_east ? z[3] - z[1] : z[2] - z[0];
            height = z[0] + along_x * u + along_y * v;
        } else if (is_cut_to_north_east) {
            along_x = z[3] - z[2];
            along_y = z[2] - z[0];
            height = z[0] + along_x * u + along_y * v;
        } else {
            along_x = z[3] - z[2];
            along_y = z[3] - z[1];
            height = z[3] - along_x * (1.0 - u) - along_y * (1.0 - v);
        }
        slope_x = along_x / side;
        slope_y = along_y / side;
    }
};

}  // namespace

Result<Scatter> Scatter::create(std::shared_ptr<const HeightSource> source,
                                const ScatterSettings& settings) {
    constexpr double kUpright = 0.5 * std::numbers::pi;
    if (!(settings.per_km2 > 0.0 && settings.per_km2 <= kMostPerKm2)) {
        return fail(ErrorCode::invalid_argument, "per_km2 must be above 0 and at most 1e+06, got " +
                                                     number_text(settings.per_km2));
    }
    const double spacing = source->lattice().spacing;
    const double in_finest_cell = settings.per_km2 / kSquareMetresPerKm2 * spacing * spacing;
    if (!(in_finest_cell <= kMostInCell)) {
        return fail(ErrorCode::invalid_argument,
                    "per_km2 must give at most 4096 objects in a cell of the finest spacing, " +
                        number_text(spacing) + " m, got " + number_text(in_finest_cell));
    }
    TERRANE_TRY(check_range("min_slope", settings.min_slope, 0.0, kUpright));
    TERRANE_TRY(check_range("max_slope", settings.max_slope, settings.min_slope, kUpright));
    if (!(settings.max_height >= settings.min_height)) {
        return fail(ErrorCode::invalid_argument, "max_height must be at least min_height, " +
                                                     number_text(settings.min_height) + ", got " +
                                                     number_text(settings.max_height));
    }
    TERRANE_TRY(check_range("min_scale", settings.min_scale, 1e-3, 1e3));
    TERRANE_TRY(check_range("max_scale", settings.max_scale, settings.min_scale, 1e3));
    return Scatter(std::move(source), settings);
}

// Chooses the largest cells (a power of two of spacings) with at most one expected object each. If even cells of one
// spacing have more, they get several candidates.
Scatter::Scatter(std::shared_ptr<const HeightSource> source, const ScatterSettings& settings)
    : source_(std::move(source)),
      settings_(settings),
      min_squared_slope_(squared_tangent_of(settings.min_slope)),
      max_squared_slope_(squared_tangent_of(settings.max_slope)) {
    const Lattice& lattice = source_->lattice();
    const double density = settings.per_km2 / kSquareMetresPerKm2;
    const double finest = density * lattice.spacing * lattice.spacing;
    const std::int64_t most = std::max<std::int64_t>(1, lattice.chunk_side(0) / kSquareCells);
    double expected = finest;
    while (cell_step_ < most && 4.0 * expected <= 1.0) {
        cell_step_ *= 2;
        expected *= 4.0;
    }
    per_cell_ = std::max(1, static_cast<int>(std::ceil(expected)));
    probability_ = expected / static_cast<double>(per_cell_);
}

double Scatter::square_side() const {
    return source_->lattice().spacing * static_cast<double>(kSquareCells * cell_step_);
}

ScatterSquare Scatter::square_at(double x, double y) const {
    const Lattice& lattice = source_->lattice();
    const double side = square_side();
    return {static_cast<std::int32_t>(std::floor((x - lattice.origin_x) / side)),
            static_cast<std::int32_t>(std::floor((y - lattice.origin_y) / side))};
}

WorldRect Scatter::rect_of(const ScatterSquare& square) const {
    const Lattice& lattice = source_->lattice();
    const std::int64_t side = kSquareCells * cell_step_;
    return {lattice.x(square.x * side), lattice.y(square.y * side),
            lattice.x((std::int64_t{square.x} + 1) * side),
            lattice.y((std::int64_t{square.y} + 1) * side)};
}

std::optional<ScatterRange> Scatter::squares_within(const WorldPos& p_world,
                                                    double distance) const {
    const WorldRect& extent = source_->extent();
    const double west = std::max(p_world.x() - distance, extent.west);
    const double south = std::max(p_world.y() - distance, extent.south);
    const double east = std::min(p_world.x() + distance, extent.east);
    const double north = std::min(p_world.y() + distance, extent.north);
    if (!(west <= east && south <= north)) return std::nullopt;
    return ScatterRange{square_at(west, south), square_at(east, north)};
}

double Scatter::distance_to(const ScatterSquare& square, const WorldPos& p_world) const {
    const WorldRect& extent = source_->extent();
    WorldRect rect = rect_of(square);
    rect.west = std::max(rect.west, extent.west);
    rect.south = std::max(rect.south, extent.south);
    rect.east = std::min(rect.east, extent.east);
    rect.north = std::min(rect.north, extent.north);
    if (!(rect.west <= rect.east && rect.south <= rect.north)) return internal::kInfinity;
    const HeightInterval heights = source_->interval(rect);
    const Eigen::Vector3d nearest(std::clamp(p_world.x(), rect.west, rect.east),
                                  std::clamp(p_world.y(), rect.south, rect.north),
                                  std::clamp(p_world.z(), heights.low, heights.high));
    return internal::length(p_world - nearest);
}

Result<std::vector<ScatterPoint>> Scatter::objects_in(const ScatterSquare& square) const {
    const Lattice& lattice = source_->lattice();
    const std::int64_t first_column = std::int64_t{square.x} * kSquareCells;
    const std::int64_t first_row = std::int64_t{square.y} * kSquareCells;
    const int samples = kSquareCells + 1;
    const SampleGrid grid = {
        {first_column * cell_step_, first_row * cell_step_}, cell_step_, samples, samples};
    std::vector<double> heights(grid.size());
    TERRANE_TRY(source_->sample(grid, heights));
    const double cell_side = lattice.spacing * static_cast<double>(cell_step_);
    const ChunkSource& chunks = chunks_of(*source_);

    // Height on the finest triangles at a position; none if it is not ground or volumes replace it.
    const auto ground_at = [&](double x, double y) -> Result<std::optional<double>> {
        const double column = (x - lattice.origin_x) / lattice.spacing;
        const double row = (y - lattice.origin_y) / lattice.spacing;
        const LatticePoint corner = {static_cast<std::int64_t>(std::floor(column)),
                                     static_cast<std::int64_t>(std::floor(row))};
        const SampleGrid cell = {corner, 1, 2, 2};
        std::uint8_t flags = cell_ground;
        TERRANE_TRY(source_->cell_flags(cell, {&flags, 1}));
        if ((flags & cell_outside) != 0) return std::optional<double>();
        std::array<double, 4> z{};
        TERRANE_TRY(source_->sample(cell, z));
        for (std::size_t i = 0; i < z.size(); ++i) {
            const double corner_x = lattice.x(corner.x + static_cast<std::int64_t>(i % 2));
            const double corner_y = lattice.y(corner.y + static_cast<std::int64_t>(i / 2));
            if (chunks.is_in_volume(corner_x, corner_y, z[i])) return std::optional<double>();
        }
        return std::optional(CellPlane(z, cut_to_north_east(corner.x, corner.y),
                                       column - static_cast<double>(corner.x),
                                       row - static_cast<double>(corner.y), lattice.spacing)
                                 .height);
    };

    std::vector<ScatterPoint> points;
    for (int i = 0; i < kSquareCells * kSquareCells * per_cell_; ++i) {
        const int candidate = i % per_cell_;
        const int column = i / per_cell_ % kSquareCells, row = i / per_cell_ / kSquareCells;
        CandidateNumbers numbers(settings_.seed, first_column + column, first_row + row, candidate);
        if (!(numbers.next() < probability_)) continue;
        const double u = numbers.next(), v = numbers.next();
        const auto sample = static_cast<std::size_t>(row * samples + column);
        const CellPlane plane({heights[sample], heights[sample + 1],
                               heights[sample + static_cast<std::size_t>(samples)],
                               heights[sample + static_cast<std::size_t>(samples) + 1]},
                              cut_to_north_east(first_column + column, first_row + row), u, v,
                              cell_side);
        if (!std::isfinite(plane.height)) {
            return fail(ErrorCode::bad_data,
                        "heights must be finite, got " + number_text(plane.height) + " in square " +
                            number_text(square.x) + ", " + number_text(square.y));
        }
        const double squared_slope = plane.slope_x * plane.slope_x + plane.slope_y * plane.slope_y;
        if (!(squared_slope >= min_squared_slope_ && squared_slope <= max_squared_slope_) ||
            !(plane.height >= settings_.min_height && plane.height <= settings_.max_height))
            continue;
        const double x = lattice.x((first_column + column) * cell_step_) + u * cell_side;
        const double y = lattice.y((first_row + row) * cell_step_) + v * cell_side;
        if (!source_->extent().contains(x, y)) continue;
        TERRANE_TRY(auto height, ground_at(x, y));
        if (!height.has_value()) continue;
        ScatterPoint point;
        point.position_world = {x, y, *height};
        point.scale =
            settings_.min_scale + (settings_.max_scale - settings_.min_scale) * numbers.next();
        // a uniformly distributed direction: a random point of the disk, without its centre
        for (int attempt = 0; attempt < 64; ++attempt) {
            const double a = 2.0 * numbers.next() - 1.0, b = 2.0 * numbers.next() - 1.0;
            const double squared = a * a + b * b;
            if (squared < 0.01 || squared > 1.0) continue;
            const double norm = std::sqrt(squared);
            point.half_turn_cosine = a / norm;
            point.half_turn_sine = b / norm;
            break;
        }
        points.push_back(point);
    }
    return points;
}

}  // namespace terrane
