// SPDX-License-Identifier: MIT
//
// Serialisation of what opening a raster computes. Sizes follow from the grid and are not written, so no file can
// give wrong ones.
#include "bounds/bound_tiers.h"
#include "bounds/height_pyramid.h"

#include <algorithm>

namespace terrane::internal {
namespace {

template <typename T>
std::span<const T> all_of(const std::vector<T>& values) {
    return values;
}

tl::unexpected<Error> other_size() {
    return fail(ErrorCode::bad_data, "kept bounds are not of this raster's size");
}

}  // namespace

void HeightPyramid::write(ByteWriter& out) const {
    out.put(slope_);
    for (const Level& level : levels_) {
        out.put(level.rise);
        for (const HeightInterval& node : level.nodes) {
            out.put(node.low);
            out.put(node.high);
        }
    }
}

Result<HeightPyramid> HeightPyramid::read(const BilinearGrid& grid, ByteReader& in) {
    HeightPyramid pyramid;
    pyramid.grid_ = grid;
    pyramid.slope_ = in.get<double>();
    Level level;
    level.columns = std::max((grid.columns - 1 + kBlockSide - 1) / kBlockSide, 1);
    level.rows = std::max((grid.rows - 1 + kBlockSide - 1) / kBlockSide, 1);
    for (;;) {
        level.rise = in.get<double>();
        level.nodes.resize(static_cast<std::size_t>(level.columns) *
                           static_cast<std::size_t>(level.rows));
        for (HeightInterval& node : level.nodes) {
            node.low = in.get<double>();
            node.high = in.get<double>();
        }
        const bool is_last = level.columns == 1 && level.rows == 1;
        pyramid.levels_.push_back(level);
        if (is_last || in.has_failed()) break;
        level.columns = (level.columns + 1) / 2;
        level.rows = (level.rows + 1) / 2;
    }
    if (in.has_failed()) return other_size();
    return pyramid;
}

void BoundTiers::write(ByteWriter& out) const {
    out.put(first().step);
    out.put(largest_);
    out.put_each(all_of(first().heights));
    out.put_each(all_of(first().cell_low));
    out.put_each(all_of(first().cell_high));
    for (const BoundTier& tier : tiers_) {
        out.put_each(all_of(tier.bounds));
        out.put_each(all_of(tier.cell_bounds));
    }
}

Result<std::unique_ptr<BoundTiers>> BoundTiers::read(std::shared_ptr<const FineSurface> fine,
                                                     ByteReader& in) {
    std::unique_ptr<BoundTiers> tiers(new BoundTiers(std::move(fine)));
    const BilinearGrid& grid = tiers->fine_->grid();
    const auto step = in.get<std::int64_t>();
    const std::int64_t ratio = step / grid.base_step();
    const bool is_possible = ratio >= 8 && ratio <= 64 && (ratio & (ratio - 1)) == 0;
    if (!is_possible || step != ratio * grid.base_step()) return other_size();
    tiers->largest_ = in.get<float>();
    BoundTier first = tiers->make_extent(step);
    for (auto* values : {&first.cell_low, &first.cell_high}) values->resize(first.bounds.size());
    first.heights.resize(first.bounds.size());
    in.get_each(std::span<double>(first.heights));
    in.get_each(std::span<float>(first.cell_low));
    in.get_each(std::span<float>(first.cell_high));
    tiers->tiers_.push_back(std::move(first));
    while (tiers->tiers_.back().step < grid.lattice.chunk_side(0)) {
        tiers->tiers_.push_back(tiers->make_extent(2 * tiers->tiers_.back().step));
    }
    for (BoundTier& tier : tiers->tiers_) {
        in.get_each(std::span<float>(tier.bounds));
        in.get_each(std::span<float>(tier.cell_bounds));
    }
    if (in.has_failed()) return other_size();
    return tiers;
}

}  // namespace terrane::internal
