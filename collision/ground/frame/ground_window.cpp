// SPDX-License-Identifier: MIT
#include "ground/frame/ground_window.h"

#include <algorithm>

namespace terrane::internal {

bool GroundWindow::is_ground(const CellRange& range) const {
    const auto width = static_cast<int>(range.east - range.west) + 1;
    const std::uint32_t all = ((std::uint32_t{1} << width) - 1u) << (range.west - cells.west);
    std::uint32_t bits = all;
    for (std::int64_t row = range.south; row <= range.north; ++row) {
        bits &= ground[static_cast<std::size_t>(row - cells.south)];
    }
    return bits == all;
}

bool GroundWindow::read(GroundReader& reader, const CellRange& range, std::int64_t base,
                        double quantum) {
    cells = {};
    if (range.east < range.west || range.north < range.south ||
        range.east - range.west >= kMostCells || range.north - range.south >= kMostCells) {
        return false;
    }
    columns = static_cast<int>(range.east - range.west) + 1;
    rows = static_cast<int>(range.north - range.south) + 1;
    is_odd = ((range.west + range.south) & 1) != 0;
    std::array<std::int32_t, static_cast<std::size_t>(kStride) * kStride> quanta;
    reader.heights(range, kStride, quanta, ground);
    cells = range;
    is_full = is_ground(range);
    std::int32_t highest = quanta[0];
    for (int row = 0; row <= rows; ++row) {
        const std::size_t first = static_cast<std::size_t>(row) * kStride;
        for (std::size_t i = first; i <= first + static_cast<std::size_t>(columns); ++i) {
            highest = std::max(highest, quanta[i]);
            z[i] = quantum * static_cast<double>(quanta[i] - base);
        }
    }
    high = quantum * static_cast<double>(highest - base);
    return true;
}

}  // namespace terrane::internal
