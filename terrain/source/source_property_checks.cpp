// SPDX-License-Identifier: MIT
//
// Checks of laws that relate answers of a source to each other, and of those about rectangles and distances.
#include "source/bounds/rounding.h"
#include "source/source_checks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <exception>
#include <utility>

namespace terrane::internal {
namespace {

// Compares bits: -0 differs from 0, and NaN equals itself.
bool same(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool same(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

// Checks the bound of a vertex, with slack, against a child's.
void SourceChecks::check_nested(const GridAnswers& answers, int column, int row, float below,
                                double slack, const char* what) {
    const auto bound = static_cast<double>(answers.vertices[answers.at(column, row)]);
    const auto found = static_cast<double>(below);
    count(SourceLaw::nesting, !(found > slack * bound), [&] {
        SourceViolation violation = at(answers, answers.point(column, row));
        violation.claimed = bound;
        violation.measured = found;
        violation.what = what;
        return violation;
    });
}

void SourceChecks::check_nesting_within(const GridAnswers& answers) {
    for (int row = 1; row < answers.grid.rows; row += 2) {
        for (int column = 1; column < answers.grid.columns; column += 2) {
            for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
                const int i = column + dx, j = row + dy;
                if (i == answers.grid.columns || j == answers.grid.rows) continue;
                check_nested(answers, column, row, answers.vertices[answers.at(i, j)], 1.0,
                             "bound of a midpoint of the centre");
            }
        }
    }
}

void SourceChecks::check_nesting_of_cells(const GridAnswers& answers) {
    for (int row = 0; row < answers.grid.rows; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < answers.grid.columns; column += 2) {
            for (const auto& [dx, dy] : {std::pair{-1, -1}, {0, -1}, {-1, 0}, {0, 0}}) {
                const int i = column + dx, j = row + dy;
                if (!answers.has_cell(i, j)) continue;
                check_nested(answers, column, row, answers.cells[answers.cell_at(i, j)], 1.0,
                             "bound of a cell beside the midpoint");
            }
        }
    }
}

// Beyond the world no mesh has vertices, so bounds there need not nest.
bool SourceChecks::is_of_world(const LatticePoint& point) const {
    const Lattice& lattice = source_.lattice();
    return point.x >= lattice.west() && point.x <= lattice.east() && point.y >= lattice.south() &&
           point.y <= lattice.north();
}

void SourceChecks::check_nesting_below(const GridAnswers& answers) {
    const SampleGrid& grid = answers.grid;
    if (grid.step == 1) return;
    GridAnswers fine;
    if (!ask({{grid.corner.x - grid.step, grid.corner.y - grid.step},
              grid.step / 2,
              2 * grid.columns + 3,
              2 * grid.rows + 3},
             fine)) {
        return;
    }
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < grid.columns; column += 2) {
            for (const auto& [dx, dy] : {std::pair{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
                const int child_column = 2 * column + 2 + dx, child_row = 2 * row + 2 + dy;
                if (!is_of_world(fine.point(child_column, child_row))) continue;
                check_nested(answers, column, row, fine.vertices[fine.at(child_column, child_row)],
                             settings_.nesting_slack, "bound of a centre of half the spacing");
            }
        }
    }
}

// Points of `some` are those of `other` at +shift columns and rows.
void SourceChecks::compare(SourceLaw law, const GridAnswers& some, const GridAnswers& other,
                           const LatticePoint& shift) {
    const auto dx = static_cast<int>(shift.x), dy = static_cast<int>(shift.y);
    for (int row = 0; row < some.grid.rows; ++row) {
        for (int column = 0; column < some.grid.columns; ++column) {
            const auto check = [&](auto is, auto was, const char* what) {
                count(law, same(is, was), [&] {
                    SourceViolation violation = at(some, some.point(column, row));
                    violation.claimed = static_cast<double>(was);
                    violation.measured = static_cast<double>(is);
                    violation.what = what;
                    return violation;
                });
            };
            const std::size_t here = some.at(column, row);
            const std::size_t there = other.at(column + dx, row + dy);
            check(other.heights[there], some.heights[here], "sample");
            check(other.vertices[there], some.vertices[here], "vertex bound");
            if (!some.has_cell(column, row)) continue;
            const std::size_t cell = some.cell_at(column, row);
            const std::size_t other_cell = other.cell_at(column + dx, row + dy);
            check(other.cells[other_cell], some.cells[cell], "cell bound");
            check(static_cast<float>(other.flags[other_cell]), static_cast<float>(some.flags[cell]),
                  "cell flags");
        }
    }
}

void SourceChecks::check_window(const GridAnswers& answers) {
    // even, so that the corner stays a multiple of twice the step
    const int west = 6, south = 4, east = 3, north = 7;
    SampleGrid large = answers.grid;
    large.corner = {large.corner.x - west * large.step, large.corner.y - south * large.step};
    large.columns += west + east;
    large.rows += south + north;
    GridAnswers other;
    if (ask(large, other)) compare(SourceLaw::window, answers, other, {west, south});
}

void SourceChecks::check_levels(const GridAnswers& answers) {
    const SampleGrid& grid = answers.grid;
    if (grid.step == 1) return;
    GridAnswers fine;
    if (!ask({grid.corner, grid.step / 2, 2 * grid.columns - 1, 2 * grid.rows - 1}, fine)) return;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const double here = answers.heights[answers.at(column, row)];
            const double there = fine.heights[fine.at(2 * column, 2 * row)];
            count(SourceLaw::levels, same(here, there), [&] {
                SourceViolation violation = at(answers, answers.point(column, row));
                violation.claimed = here;
                violation.measured = there;
                violation.what = "sample of the next finer level";
                return violation;
            });
        }
    }
}

void SourceChecks::check_mesh_bounds(const GridAnswers& answers) {
    if (answers.cells.empty()) return;
    GridAnswers both = answers;
    both.vertices.assign(answers.vertices.size(), -1.0f);
    both.cells.assign(answers.cells.size(), -1.0f);
    std::string message;
    try {
        const Result<void> read = source_.mesh_bounds(answers.grid, both.vertices, both.cells);
        if (!read) message = read.error().message;
    } catch (const std::exception& thrown) {
        message = std::string("it threw ") + thrown.what();
    }
    count(SourceLaw::answers, message.empty(), [&] {
        SourceViolation violation = at(answers, answers.grid.corner);
        violation.what = "mesh_bounds(): " + message;
        return violation;
    });
    if (message.empty()) compare(SourceLaw::mesh_bounds, answers, both, {0, 0});
}

void SourceChecks::check_again(const GridAnswers& answers, SourceLaw law) {
    GridAnswers again;
    if (ask(answers.grid, again)) compare(law, answers, again, {0, 0});
}

void SourceChecks::check_interval(const WorldRect& rect, int level) {
    const HeightInterval claimed = source_.interval(rect);
    const auto broken = [&](const Peak& peak, double bound, double measured) {
        char what[96];
        std::snprintf(what, sizeof what, "rectangle of %.6g x %.6g m", rect.east - rect.west,
                      rect.north - rect.south);
        return SourceViolation{.x = peak.x,
                               .y = peak.y,
                               .level = level,
                               .claimed = bound,
                               .measured = measured,
                               .what = what};
    };
    const bool is_interval = claimed.low <= claimed.high;
    count(SourceLaw::interval, is_interval, [&] {
        return broken({0.0, rect.west, rect.south}, claimed.low, claimed.high);
    });
    if (!is_interval) return;
    for (const double sign : {1.0, -1.0}) {
        const auto measure = [&](double x, double y) { return sign * height(x, y); };
        Peak peak{measure(rect.west, rect.south), rect.west, rect.south};
        const auto take = [&](double x, double y) {
            const double value = measure(x, y);
            if (value > peak.value) peak = {value, x, y};
        };
        for (const double y : {rect.south, rect.north}) {
            for (const double x : {rect.west, rect.east}) take(x, y);
        }
        for (int i = 0; i < 2 * settings_.points; ++i) {
            const double x = random_.between(rect.west, rect.east);
            take(x, random_.between(rect.south, rect.north));
        }
        const double step = 0.1 * std::max(rect.east - rect.west, rect.north - rect.south);
        peak = climb(rect, peak, step, measure);
        const double end = sign > 0.0 ? claimed.high : claimed.low;
        const double allowed = sign * end + kHeightAccuracy + 0x1p-50 * std::abs(end);
        count(SourceLaw::interval, !(peak.value > allowed),
              [&] { return broken(peak, end, sign * peak.value); });
    }
}

void SourceChecks::check_rise(double distance, int level) {
    const double claimed = source_.rise_bound(distance);
    const auto broken = [&](const Peak& peak, double bound, double measured, const char* text) {
        char what[96];
        std::snprintf(what, sizeof what, text, distance);
        return SourceViolation{.x = peak.x,
                               .y = peak.y,
                               .level = level,
                               .claimed = bound,
                               .measured = measured,
                               .what = what};
    };
    const double of_less = source_.rise_bound(0.75 * distance);
    const bool grows = of_less >= 0.0 && claimed >= of_less;
    count(SourceLaw::rise_bound, grows,
          [&] { return broken({}, of_less, claimed, "bound over %.6g m, below that over less"); });
    if (!grows) return;
    // slightly less, for the rounding of the position
    const double length = distance * (1.0 - 0x1p-50);
    for (const auto& [along, across] : {std::pair{1.0, 0.0}, {0.0, 1.0}, {0.8, 0.6}, {-0.6, 0.8}}) {
        const double to_x = along * length, to_y = across * length;
        const auto measure = [&](double x, double y) {
            const double fx = x + to_x, fy = y + to_y;
            if (!measured_.contains(x, y) || !measured_.contains(fx, fy)) return -1.0;
            const double here = height(x, y), there = height(fx, fy);
            return std::abs(there - here) - rounding(x, y, here, std::abs(there - here) / distance);
        };
        Peak peak{-1.0, measured_.west, measured_.south};
        for (int i = 0; i < 2 * settings_.points; ++i) {
            const double x = random_.between(measured_.west, measured_.east);
            const double y = random_.between(measured_.south, measured_.north);
            const double value = measure(x, y);
            if (value > peak.value) peak = {value, x, y};
        }
        if (peak.value < 0.0) continue;
        peak = climb(measured_, peak, 0.25 * distance, measure);
        count(SourceLaw::rise_bound, !(peak.value > claimed),
              [&] { return broken(peak, claimed, peak.value, "points %.6g m apart"); });
    }
}

}  // namespace terrane::internal
