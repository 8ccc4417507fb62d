// SPDX-License-Identifier: MIT
#include "local_ground.h"

#include <cmath>

namespace terrane::internal {

LocalGround::LocalGround(const Ground& ground, const WorldPos& near_world)
    : reader_(ground), spacing_(ground.spacing()), quantum_(ground.lattice().quantum) {
    // Far outside the extent the nearest lattice point of the extent serves.
    const WorldRect& extent = ground.extent();
    column_ = ground.column_at(std::clamp(near_world.x(), extent.west, extent.east));
    row_ = ground.row_at(std::clamp(near_world.y(), extent.south, extent.north));
    base_ = static_cast<std::int64_t>(
        std::floor(std::clamp(near_world.z() / quantum_, -0x1p52, 0x1p52)));
    place();
}

LocalGround::LocalGround(const LocalGround& other, const Eigen::Vector3d& near)
    : LocalGround(other) {
    // Beyond this no cell and no height can lie.
    constexpr double kFar = 0x1p40;
    const auto steps = [&](double p, double step) {
        return static_cast<std::int64_t>(std::floor(std::clamp(p / step, -kFar, kFar)));
    };
    column_ += steps(near[0], spacing_);
    row_ += steps(near[1], spacing_);
    base_ += steps(near[2], quantum_);
    place();
}

void LocalGround::place() {
    origin_world_ = {ground().cell_x(column_), ground().cell_y(row_),
                     quantum_ * static_cast<double>(base_)};
}

CellRange LocalGround::cells(double west, double south, double east, double north) const {
    const WorldRect& extent = ground().extent();
    const double limit_west = extent.west - origin_world_.x() - spacing_;
    const double limit_east = extent.east - origin_world_.x() + spacing_;
    const double limit_south = extent.south - origin_world_.y() - spacing_;
    const double limit_north = extent.north - origin_world_.y() + spacing_;
    CellRange none;
    if (!(west <= limit_east && east >= limit_west && south <= limit_north &&
          north >= limit_south)) {
        return none;
    }
    // A rectangle whose western side lies on a line meets the cells to the west of it too.
    const auto first = [this](double p) {
        return static_cast<std::int64_t>(std::ceil(p / spacing_)) - 1;
    };
    const auto last = [this](double p) {
        return static_cast<std::int64_t>(std::floor(p / spacing_));
    };
    return {column_ + first(std::max(west, limit_west)), row_ + first(std::max(south, limit_south)),
            column_ + last(std::min(east, limit_east)), row_ + last(std::min(north, limit_north))};
}

Prism LocalGround::prism(const CellRange& cells, std::int32_t high) const {
    return {x(cells.west), y(cells.south), x(cells.east + 1), y(cells.north + 1), z(high)};
}

std::array<Triangle, 2> LocalGround::triangles(const GroundCell& cell, std::int64_t column,
                                               std::int64_t row) const {
    const double west = x(column);
    const double east = x(column + 1);
    const double south = y(row);
    const double north = y(row + 1);
    const Eigen::Vector3d sw(west, south, z(cell.south_west));
    const Eigen::Vector3d se(east, south, z(cell.south_east));
    const Eigen::Vector3d nw(west, north, z(cell.north_west));
    const Eigen::Vector3d ne(east, north, z(cell.north_east));
    if (cell.cut_to_north_east) return {make_triangle(sw, se, ne), make_triangle(sw, ne, nw)};
    return {make_triangle(sw, se, nw), make_triangle(se, ne, nw)};
}

}  // namespace terrane::internal
