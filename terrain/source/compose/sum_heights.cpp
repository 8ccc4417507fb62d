// SPDX-License-Identifier: MIT
//
// z = a + f b. Both interpolate linearly over the same triangles, so deviations, intervals and rises add.
#include "base/settings_check.h"
#include "source/bounds/mesh_bounds.h"
#include "source/bounds/rounding.h"
#include "source/compose/source_pair.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/composed_heights.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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
        if (auto ok = a().sample(grid, heights_out); !ok) return ok;
        if (auto ok = b().sample(grid, others); !ok) return ok;
        for (std::size_t i = 0; i < grid.size(); ++i) heights_out[i] += factor_ * others[i];
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        std::vector<float> others(bounds_out.size());
        if (auto ok = a().vertex_bounds(grid, bounds_out); !ok) return ok;
        if (auto ok = b().vertex_bounds(grid, others); !ok) return ok;
        add(others, bounds_out);
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        std::vector<float> others(bounds_out.size());
        if (auto ok = a().cell_bounds(grid, bounds_out); !ok) return ok;
        if (auto ok = b().cell_bounds(grid, others); !ok) return ok;
        add(others, bounds_out);
        return {};
    }

    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        std::vector<float> vertices(vertex_bounds_out.size()), cells(cell_bounds_out.size());
        if (auto ok = a().mesh_bounds(grid, vertex_bounds_out, cell_bounds_out); !ok) return ok;
        if (auto ok = b().mesh_bounds(grid, vertices, cells); !ok) return ok;
        add(vertices, vertex_bounds_out);
        add(cells, cell_bounds_out);
        return {};
    }

    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        std::vector<std::uint8_t> others(flags_out.size());
        if (auto ok = a().cell_flags(grid, flags_out); !ok) return ok;
        if (auto ok = b().cell_flags(grid, others); !ok) return ok;
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
    if (auto ok = internal::check_pair(*a, *b); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_range("factor", factor, -1e6, 1e6); !ok) return tl::unexpected(ok.error());
    return std::make_shared<const Sum>(std::move(a), std::move(b), factor);
}

}  // namespace terrane
