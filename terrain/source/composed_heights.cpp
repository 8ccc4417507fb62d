// SPDX-License-Identifier: MIT
#include "source/composed_heights.h"

#include "base/settings_check.h"
#include "source/mesh_bounds.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/composed_heights.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace {

WorldRect common(const WorldRect& a, const WorldRect& b) {
    return {std::max(a.west, b.west), std::max(a.south, b.south), std::min(a.east, b.east),
            std::min(a.north, b.north)};
}

}  // namespace

Result<void> check_pair(const HeightSource& a, const HeightSource& b) {
    if (!(a.lattice() == b.lattice())) {
        return fail(ErrorCode::invalid_argument,
                    "the sources must have the same lattice, got spacings of " +
                        number_text(a.lattice().spacing) + " and " +
                        number_text(b.lattice().spacing) + " m, or other origins or roots");
    }
    const WorldRect extent = common(a.extent(), b.extent());
    if (extent.west < extent.east && extent.south < extent.north) return {};
    return fail(ErrorCode::invalid_argument, "the extents of the sources do not overlap");
}

SourcePair::SourcePair(std::shared_ptr<const HeightSource> a, std::shared_ptr<const HeightSource> b)
    : HeightSource(a->lattice(), common(a->extent(), b->extent())),
      a_(std::move(a)),
      b_(std::move(b)) {}

WorldRect SourcePair::square_around(const SampleGrid& grid, std::int64_t steps_beyond) const {
    const std::int64_t width = grid.step * (grid.columns - 1), depth = grid.step * (grid.rows - 1);
    // half a step more than needed, to allow for rounding
    const double half_side =
        lattice().spacing *
        (0.5 * static_cast<double>(std::max(width, depth)) +
         (static_cast<double>(steps_beyond) + 0.5) * static_cast<double>(grid.step));
    const double x =
        lattice().x(grid.corner.x) + 0.5 * lattice().spacing * static_cast<double>(width);
    const double y =
        lattice().y(grid.corner.y) + 0.5 * lattice().spacing * static_cast<double>(depth);
    return {x - half_side, y - half_side, x + half_side, y + half_side};
}

WorldRect SourcePair::world() const {
    const std::int64_t side = lattice().chunk_side(0);
    const std::int64_t west = side * lattice().first_root_x, south = side * lattice().first_root_y;
    return rect({west, south},
                {west + side * lattice().root_count_x, south + side * lattice().root_count_y});
}

}  // namespace terrane::internal

// Sums: z = a + f b. Both sources are interpolated linearly over the same triangles, so that the deviations, intervals
// and rises of a and f b add up.

namespace terrane {
namespace {

class Sum final : public internal::SourcePair {
public:
    Sum(std::shared_ptr<const HeightSource> a, std::shared_ptr<const HeightSource> b, double factor)
        : SourcePair(std::move(a), std::move(b)), factor_(factor) {}

    double height(double x, double y) const override {
        return a().height(x, y) + factor_ * b().height(x, y);
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::vector<double> others(grid.size());
        TERRANE_TRY(a().sample(grid, heights_out));
        TERRANE_TRY(b().sample(grid, others));
        for (std::size_t i = 0; i < grid.size(); ++i) heights_out[i] += factor_ * others[i];
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        std::vector<float> others(bounds_out.size());
        TERRANE_TRY(a().vertex_bounds(grid, bounds_out));
        TERRANE_TRY(b().vertex_bounds(grid, others));
        add(others, bounds_out);
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        std::vector<float> others(bounds_out.size());
        TERRANE_TRY(a().cell_bounds(grid, bounds_out));
        TERRANE_TRY(b().cell_bounds(grid, others));
        add(others, bounds_out);
        return {};
    }

    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        std::vector<float> vertices(vertex_bounds_out.size()), cells(cell_bounds_out.size());
        TERRANE_TRY(a().mesh_bounds(grid, vertex_bounds_out, cell_bounds_out));
        TERRANE_TRY(b().mesh_bounds(grid, vertices, cells));
        add(vertices, vertex_bounds_out);
        add(cells, cell_bounds_out);
        return {};
    }

    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        std::vector<std::uint8_t> others(flags_out.size());
        TERRANE_TRY(a().cell_flags(grid, flags_out));
        TERRANE_TRY(b().cell_flags(grid, others));
        for (std::size_t i = 0; i < others.size(); ++i) {
            flags_out[i] = static_cast<std::uint8_t>(flags_out[i] | others[i]);
        }
        return {};
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const HeightInterval some = a().interval(rect), other = b().interval(rect);
        const double low = factor_ * (factor_ < 0.0 ? other.high : other.low);
        const double high = factor_ * (factor_ < 0.0 ? other.low : other.high);
        const double slack =
            0x1p-50 * (std::abs(some.low) + std::abs(some.high) + std::abs(low) + std::abs(high));
        return {some.low + low - slack, some.high + high + slack};
    }

    double rise_bound(double distance) const override {
        return (a().rise_bound(distance) + std::abs(factor_) * b().rise_bound(distance)) * kOutward;
    }

private:
    void add(std::span<const float> others, std::span<float> bounds) const {
        for (std::size_t i = 0; i < others.size(); ++i) {
            bounds[i] = round_up((static_cast<double>(bounds[i]) +
                                  std::abs(factor_) * static_cast<double>(others[i])) *
                                 kOutward);
        }
    }

    double factor_;
};

}  // namespace

Result<std::shared_ptr<const HeightSource>> sum_heights(std::shared_ptr<const HeightSource> a,
                                                        std::shared_ptr<const HeightSource> b,
                                                        double factor) {
    TERRANE_ASSERT(a != nullptr && b != nullptr, "a sum has two sources");
    TERRANE_TRY(internal::check_pair(*a, *b));
    TERRANE_TRY(check_range("factor", factor, -1e6, 1e6));
    return std::make_shared<const Sum>(std::move(a), std::move(b), factor);
}

// Blends: z = (1 - m) a + m b. For p = sum w_i v_i in a triangle with corners v_i and longest edge l,
//
//   z(p) - sum w_i z(v_i) = (1 - m(p)) (a(p) - sum w_i a(v_i)) + m(p) (b(p) - sum w_i b(v_i))
//                           + sum w_i (m(p) - m(v_i)) (b(v_i) - a(v_i)).
//
// The first two terms are a weighted mean of the sources' deviations. The third is at most d sum w_i |m(p) - m(v_i)|,
// where d is the largest |b - a|. For a mask with values in [least, most], |m(p) - m(v_i)| <= most - least. For a mask
// with Lipschitz bound S, |m(p) - m(v_i)| <= S |p - v_i|, and sum w_i |p - v_i| <= l / 2 (function_heights.cpp).
//
// Nesting. For a vertex, the mask and d are taken over a square around it. Its half side is 3 s for a centre of spacing
// s and 2 s for a midpoint, so that it contains the squares of the vertex's children (detail_heights.cpp).

namespace {

// Bit-identical to one of the heights if the mask is 0 or 1.
double mix(double a, double b, double mask) {
    if (mask == 0.0) return a;
    return mask == 1.0 ? b : a + mask * (b - a);
}

bool is_zero(const MaskInterval& mask) { return mask.most <= 0.0; }
bool is_one(const MaskInterval& mask) { return mask.least >= 1.0; }

class Blend final : public internal::SourcePair {
public:
    Blend(std::shared_ptr<const HeightSource> first, std::shared_ptr<const HeightSource> second,
          std::shared_ptr<const BlendMask> mask)
        : SourcePair(std::move(first), std::move(second)), mask_(std::move(mask)) {
        const WorldRect all = world(), support = mask_->support();
        const WorldRect within{std::max(all.west, support.west), std::max(all.south, support.south),
                               std::min(all.east, support.east),
                               std::min(all.north, support.north)};
        if (within.west <= within.east && within.south <= within.north) {
            largest_step_ = distance_over(within);
        }
    }

    double height(double x, double y) const override {
        const double mask = mask_->at(x, y);
        if (mask == 0.0) return a().height(x, y);
        if (mask == 1.0) return b().height(x, y);
        return mix(a().height(x, y), b().height(x, y), mask);
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        const MaskInterval all = mask_->over(square_around(grid, 0));
        if (is_one(all)) return b().sample(grid, heights_out);
        if (auto ok = a().sample(grid, heights_out); !ok || is_zero(all)) return ok;
        std::vector<double> others(grid.size());
        TERRANE_TRY(b().sample(grid, others));
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            const double y = lattice().y(grid.corner.y + row * grid.step);
            for (int column = 0; column < grid.columns; ++column, ++i) {
                const double x = lattice().x(grid.corner.x + column * grid.step);
                const double mask = mask_->at(x, y);
                if (std::isnan(mask)) {
                    return fail(ErrorCode::io, "the mask has no value at x " + number_text(x) +
                                                   " m, y " + number_text(y) + " m");
                }
                heights_out[i] = mix(heights_out[i], others[i], mask);
            }
        }
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return blend_bounds(grid, bounds_out, {});
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return blend_bounds(grid, {}, bounds_out);
    }
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        return blend_bounds(grid, vertex_bounds_out, cell_bounds_out);
    }

    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        const MaskInterval all = mask_->over(square_around(grid, 0));
        if (is_one(all)) return b().cell_flags(grid, flags_out);
        if (auto ok = a().cell_flags(grid, flags_out); !ok || is_zero(all)) return ok;
        std::vector<std::uint8_t> others(flags_out.size());
        TERRANE_TRY(b().cell_flags(grid, others));
        visit_cells(grid, [&](std::size_t i, const WorldRect& cell) {
            const MaskInterval mask = mask_->over(cell);
            if (is_one(mask)) {
                flags_out[i] = others[i];
            } else if (!is_zero(mask)) {
                flags_out[i] = static_cast<std::uint8_t>(flags_out[i] | others[i]);
            }
        });
        return {};
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const MaskInterval mask = mask_->over(rect);
        if (is_zero(mask)) return a().interval(rect);
        if (is_one(mask)) return b().interval(rect);
        const HeightInterval some = a().interval(rect), other = b().interval(rect);
        // a weighted mean is monotone in the mask: its extremes are at the ends of the mask's interval
        const auto at = [](double of_a, double of_b, double part) {
            return (1.0 - part) * of_a + part * of_b;
        };
        const double slack = 0x1p-49 * std::max({std::abs(some.low), std::abs(some.high),
                                                 std::abs(other.low), std::abs(other.high)});
        return {
            std::min(at(some.low, other.low, mask.least), at(some.low, other.low, mask.most)) -
                slack,
            std::max(at(some.high, other.high, mask.least), at(some.high, other.high, mask.most)) +
                slack};
    }

    double rise_bound(double distance) const override {
        const double share = std::min(1.0, mask_->slope() * distance);
        return (std::max(a().rise_bound(distance), b().rise_bound(distance)) +
                (share > 0.0 ? share * largest_step_ : 0.0)) *
               kOutward;
    }

private:
    // Bound of |b - a| over a rectangle.
    double distance_over(const WorldRect& rect) const {
        const HeightInterval some = a().interval(rect), other = b().interval(rect);
        return std::max({0.0, other.high - some.low, some.high - other.low});
    }

    template <class Visit>
    void visit_cells(const SampleGrid& grid, Visit visit) const {
        std::size_t i = 0;
        for (int row = 0; row + 1 < grid.rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column, ++i) {
                const LatticePoint low{grid.corner.x + column * grid.step,
                                       grid.corner.y + row * grid.step};
                visit(i, rect(low, {low.x + grid.step, low.y + grid.step}));
            }
        }
    }

    // Bound of the blend's deviation over triangles in the rectangle `around`.
    float bound(float of_a, float of_b, const WorldRect& around, double longest_edge) const {
        const MaskInterval mask = mask_->over(around);
        if (is_zero(mask)) return of_a;
        if (is_one(mask)) return of_b;
        const auto at = [&](double part) {
            return (1.0 - part) * static_cast<double>(of_a) + part * static_cast<double>(of_b);
        };
        const double share = std::min(mask.most - mask.least, 0.5 * mask_->slope() * longest_edge);
        const double step = share > 0.0 ? share * distance_over(around) : 0.0;
        return round_up((std::max(at(mask.least), at(mask.most)) + step) * kOutward);
    }

    Result<void> blend_bounds(const SampleGrid& grid, std::span<float> vertices,
                              std::span<float> cells) const {
        const MaskInterval all = mask_->over(square_around(grid, vertices.empty() ? 0 : 3));
        if (is_one(all)) return read_bounds(b(), grid, vertices, cells);
        if (auto ok = read_bounds(a(), grid, vertices, cells); !ok || is_zero(all)) return ok;
        std::vector<float> other_vertices(vertices.size()), other_cells(cells.size());
        TERRANE_TRY(read_bounds(b(), grid, other_vertices, other_cells));
        const double spacing = lattice().spacing * static_cast<double>(grid.step);
        if (!cells.empty()) {
            visit_cells(grid, [&](std::size_t i, const WorldRect& cell) {
                cells[i] = bound(cells[i], other_cells[i], cell, kSqrt2 * spacing);
            });
        }
        for (int row = 0; row < grid.rows && !vertices.empty(); ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                if (((row | column) & 1) == 0) continue;  // a vertex of a coarser spacing
                const bool is_centre = (row & column & 1) != 0;
                const std::int64_t reach = (is_centre ? 3 : 2) * grid.step;
                const LatticePoint at{grid.corner.x + column * grid.step,
                                      grid.corner.y + row * grid.step};
                const auto i = static_cast<std::size_t>(row * grid.columns + column);
                vertices[i] =
                    bound(vertices[i], other_vertices[i],
                          rect({at.x - reach, at.y - reach}, {at.x + reach, at.y + reach}),
                          (is_centre ? 2.0 * kSqrt2 : 2.0) * spacing);
            }
        }
        return {};
    }

    // Reads the bounds of one source; skips an empty span.
    static Result<void> read_bounds(const HeightSource& source, const SampleGrid& grid,
                                    std::span<float> vertices, std::span<float> cells) {
        if (cells.empty()) return source.vertex_bounds(grid, vertices);
        if (vertices.empty()) return source.cell_bounds(grid, cells);
        return source.mesh_bounds(grid, vertices, cells);
    }

    std::shared_ptr<const BlendMask> mask_;
    double largest_step_ = 0.0;  // bound of |b - a| where the mask is not 0
};

}  // namespace

Result<std::shared_ptr<const HeightSource>> blend_heights(std::shared_ptr<const HeightSource> a,
                                                          std::shared_ptr<const HeightSource> b,
                                                          std::shared_ptr<const BlendMask> mask) {
    TERRANE_ASSERT(a != nullptr && b != nullptr && mask != nullptr,
                   "a blend has two sources and a mask");
    TERRANE_TRY(internal::check_pair(*a, *b));
    return std::make_shared<const Blend>(std::move(a), std::move(b), std::move(mask));
}

}  // namespace terrane
