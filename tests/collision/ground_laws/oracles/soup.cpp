// SPDX-License-Identifier: MIT
#include "soup.h"

#include <limits>

namespace terrane::test {

Soup::Soup(const Ground& ground) : spacing_(ground.spacing()) {
    const WorldRect& extent = ground.extent();
    west_ = extent.west;
    south_ = extent.south;
    side_ = static_cast<int>(std::lround((extent.east - extent.west) / spacing_));
    const auto count = static_cast<std::size_t>(side_);
    heights_.assign((count + 1) * (count + 1), 0.0);
    highest_.assign(count * count, -std::numeric_limits<double>::infinity());
    is_cell_.assign(count * count, false);
    const std::int64_t first_column = ground.column_at(west_), first_row = ground.row_at(south_);
    for (int row = 0; row < side_; ++row) {
        for (int column = 0; column < side_; ++column) {
            const GroundCell cell = ground.cell(first_column + column, first_row + row);
            if (cell.status != GroundStatus::ok) continue;
            is_cell_[index(column, row)] = true;
            const std::array<std::int32_t, 4> corners{cell.south_west, cell.south_east,
                                                      cell.north_west, cell.north_east};
            for (int k = 0; k < 4; ++k) {
                const double z = ground.lattice().quantum * corners[static_cast<std::size_t>(k)];
                heights_[static_cast<std::size_t>((row + k / 2) * (side_ + 1) + column + k % 2)] =
                    z;
                highest_[index(column, row)] = std::max(highest_[index(column, row)], z);
            }
        }
    }
}

double Soup::height(double x, double y) const {
    const double u = (x - west_) / spacing_, v = (y - south_) / spacing_;
    const int column = std::clamp(static_cast<int>(std::floor(u)), 0, side_ - 1);
    const int row = std::clamp(static_cast<int>(std::floor(v)), 0, side_ - 1);
    const double s = u - column, t = v - row;
    const double sw = vertex(column, row).z(), se = vertex(column + 1, row).z();
    const double nw = vertex(column, row + 1).z(), ne = vertex(column + 1, row + 1).z();
    if (is_cut_to_north_east(column, row)) {
        return s > t ? sw + s * (se - sw) + t * (ne - se) : sw + s * (ne - nw) + t * (nw - sw);
    }
    return s + t < 1.0 ? sw + s * (se - sw) + t * (nw - sw)
                       : ne - (1.0 - s) * (ne - nw) - (1.0 - t) * (ne - se);
}

}  // namespace terrane::test
