// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

// The contact surface, implemented independently of the library from its definition.
namespace judge {

struct Vec {
    double x = 0.0, y = 0.0, z = 0.0;
};
inline Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, const Vec& a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Heights at lattice points (column, row), x = west + column * spacing, y = south + row * spacing.
/// A cell is split along its south-west to north-east diagonal where column + row + parity is even, along the other one
/// elsewhere. Cells with a missing height (NaN) have no ground.
class Surface {
public:
    double spacing = 1.0;
    double west = 0.0, south = 0.0;
    int parity = 0;

    /// A full grid, row by row from the south.
    void set_grid(std::int64_t columns, std::int64_t rows, std::vector<double> heights) {
        columns_ = columns;
        rows_ = rows;
        grid_ = std::move(heights);
    }
    /// A single point; do not combine points with a grid.
    void set_point(std::int64_t column, std::int64_t row, double height) {
        points_[{column, row}] = height;
    }

    double height(std::int64_t column, std::int64_t row) const {
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        if (!grid_.empty()) {
            if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return kNone;
            return grid_[static_cast<std::size_t>(row * columns_ + column)];
        }
        const auto found = points_.find({column, row});
        return found == points_.end() ? kNone : found->second;
    }
    bool is_cut_to_north_east(std::int64_t column, std::int64_t row) const {
        return ((column + row + parity) & 1) == 0;
    }
    std::int64_t column_below(double x) const {
        return static_cast<std::int64_t>(std::floor((x - west) / spacing));
    }
    std::int64_t row_below(double y) const {
        return static_cast<std::int64_t>(std::floor((y - south) / spacing));
    }

private:
    struct PairHash {
        std::size_t operator()(const std::pair<std::int64_t, std::int64_t>& p) const {
            const auto mixed = static_cast<std::uint64_t>(p.first) * 0x9e3779b97f4a7c15u ^
                               static_cast<std::uint64_t>(p.second) * 0xc2b2ae3d27d4eb4fu;
            return static_cast<std::size_t>(mixed ^ (mixed >> 31));
        }
    };
    std::int64_t columns_ = 0, rows_ = 0;
    std::vector<double> grid_;
    std::unordered_map<std::pair<std::int64_t, std::int64_t>, double, PairHash> points_;
};

}  // namespace judge
