// SPDX-License-Identifier: MIT
#pragma once

#include "source/mesh_bounds.h"

#include <terrane/terrain/check_source.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// Random numbers that are the same on every machine: SplitMix64 (G. Steele, D. Lea, C. Flood, 2014).
class CheckRandom {
public:
    explicit CheckRandom(std::uint64_t seed) : state_(seed) {}
    std::uint64_t bits();
    /// In [low, high).
    double between(double low, double high);
    /// In [low, high], both ends included.
    std::int64_t integer(std::int64_t low, std::int64_t high);

private:
    std::uint64_t state_;
};

/// All answers of a source for one grid; without cells if the grid's vertices are coarser than a root's samples.
struct GridAnswers {
    SampleGrid grid;
    std::vector<double> heights;      ///< [grid.size()]
    std::vector<float> vertices;      ///< [grid.size()]
    std::vector<float> cells;         ///< [(columns - 1) * (rows - 1)], or empty
    std::vector<std::uint8_t> flags;  ///< as cells

    std::size_t at(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
               static_cast<std::size_t>(column);
    }
    std::size_t cell_at(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns - 1) +
               static_cast<std::size_t>(column);
    }
    /// Whether the answers include the cell to the north-east of a point.
    bool has_cell(int column, int row) const {
        return !cells.empty() && column >= 0 && row >= 0 && column + 1 < grid.columns &&
               row + 1 < grid.rows;
    }
    LatticePoint point(int column, int row) const {
        return {grid.corner.x + grid.step * column, grid.corner.y + grid.step * row};
    }
};

/// Checks the laws of a source on given grids and rectangles, and counts the results in a report.
///
/// Corners of grids must be multiples of 2 * step. Threads: one.
class SourceChecks {
public:
    /// @param source   must outlive the checks
    /// @param measured deviations are measured only inside this rectangle
    SourceChecks(const HeightSource& source, const SourceCheckSettings& settings,
                 const WorldRect& measured);

    /// Makes all calls for a grid. If one fails, counts a violation of `answers` and returns false.
    bool ask(const SampleGrid& grid, GridAnswers& answers_out);

    void check_values(const GridAnswers& answers);
    void check_bounds(const GridAnswers& answers);
    /// Checks, without slack, that bounds of centres are at least the bounds of their midpoints.
    void check_nesting_within(const GridAnswers& answers);
    /// Checks that bounds of midpoints are at least those of the cells around them: true of fractals, but not a law.
    void check_nesting_of_cells(const GridAnswers& answers);
    /// Checks, with the settings' slack, that bounds of midpoints are at least the bounds of the centres of half the
    /// spacing around them. Does nothing for a step of 1.
    void check_nesting_below(const GridAnswers& answers);
    void check_window(const GridAnswers& answers);
    /// Compares samples with the next finer level's at the same points. Does nothing for a step of 1.
    void check_levels(const GridAnswers& answers);
    /// Compares mesh_bounds() with the separate calls. Does nothing if the answers have no cells.
    void check_mesh_bounds(const GridAnswers& answers);
    /// Repeats the calls; counts a violation of `law` if a bit differs.
    void check_again(const GridAnswers& answers, SourceLaw law);
    void check_interval(const WorldRect& rect, int level);
    void check_rise(double distance, int level);
    /// Counts one check of a law; if the law does not hold, records the violation.
    void count(SourceLaw law, bool holds, const std::function<SourceViolation()>& violation);

    const SourceReport& report() const { return report_; }
    /// Adds the counts of other checks of the same source.
    void add(const SourceReport& other);

private:
    struct Peak {
        double value = 0.0, x = 0.0, y = 0.0;
    };
    using Measure = std::function<double(double x, double y)>;
    Peak climb(const WorldRect& within, Peak from, double step, const Measure& measure);
    Peak largest_deviation(const LatticeTriangle& triangle, double claimed);
    void check_triangles(const GridAnswers& answers, const LatticePoint& place,
                         const std::array<LatticeTriangle, 2>& triangles, float bound,
                         SourceLaw law, const std::string& what);
    bool is_of_world(const LatticePoint& point) const;
    void check_nested(const GridAnswers& answers, int column, int row, float below, double slack,
                      const char* what);
    void compare(SourceLaw law, const GridAnswers& some, const GridAnswers& other,
                 const LatticePoint& shift);
    SourceViolation at(const GridAnswers& answers, const LatticePoint& point) const;
    double rounding(double x, double y, double height, double slope) const;
    double height(double x, double y);

    const HeightSource& source_;
    SourceCheckSettings settings_;
    WorldRect measured_;
    CheckRandom random_;
    SourceReport report_;
};

/// Level of a spacing; negative for vertices coarser than a root's samples.
int level_of(const Lattice& lattice, std::int64_t step);

}  // namespace terrane::internal
