// SPDX-License-Identifier: MIT
#include "source/source_checks.h"

#include "source/mesh_bounds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <utility>

namespace terrane::internal {
namespace {

std::string metres(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g m", value);
    return text;
}

}  // namespace

std::uint64_t CheckRandom::bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double CheckRandom::between(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53);
}

std::int64_t CheckRandom::integer(std::int64_t low, std::int64_t high) {
    const auto count = static_cast<std::uint64_t>(high - low) + 1;
    return low + static_cast<std::int64_t>(bits() % count);
}

int level_of(const Lattice& lattice, std::int64_t step) {
    return lattice.finest_level - std::countr_zero(static_cast<std::uint64_t>(step));
}

SourceChecks::SourceChecks(const HeightSource& source, const SourceCheckSettings& settings,
                           const WorldRect& measured)
    : source_(source), settings_(settings), measured_(measured), random_(settings.seed) {
    report_.seed = settings.seed;
}

void SourceChecks::count(SourceLaw law, bool holds,
                         const std::function<SourceViolation()>& violation) {
    SourceLawReport& into = report_.laws[static_cast<std::size_t>(law)];
    ++into.checks;
    if (holds) return;
    ++into.broken;
    SourceViolation found = violation();
    found.law = law;
    // NaN counts as the worst
    const auto excess = [](const SourceViolation& v) {
        const double by = std::abs(v.measured - v.claimed);
        return std::isnan(by) ? std::numeric_limits<double>::infinity() : by;
    };
    const auto place =
        std::ranges::find_if(into.worst, [&](const auto& v) { return excess(v) < excess(found); });
    into.worst.insert(place, std::move(found));
    if (into.worst.size() > SourceLawReport::kMostWorst) into.worst.pop_back();
}

void SourceChecks::add(const SourceReport& other) {
    for (std::size_t i = 0; i < kSourceLawCount; ++i) {
        SourceLawReport& into = report_.laws[i];
        into.checks += other.laws[i].checks;
        into.broken += other.laws[i].broken;
        for (const SourceViolation& v : other.laws[i].worst) {
            if (into.worst.size() < SourceLawReport::kMostWorst) into.worst.push_back(v);
        }
    }
    report_.tightest = std::max(report_.tightest, other.tightest);
}

SourceViolation SourceChecks::at(const GridAnswers& answers, const LatticePoint& point) const {
    SourceViolation violation;
    violation.x = source_.lattice().x(point.x);
    violation.y = source_.lattice().y(point.y);
    violation.level = level_of(source_.lattice(), answers.grid.step);
    return violation;
}

bool SourceChecks::ask(const SampleGrid& grid, GridAnswers& answers_out) {
    const bool has_cells = grid.step <= source_.lattice().step(0);
    const std::size_t cells = has_cells ? static_cast<std::size_t>(grid.columns - 1) *
                                              static_cast<std::size_t>(grid.rows - 1)
                                        : 0;
    answers_out.grid = grid;
    // impossible values reveal outputs that the source does not write
    answers_out.heights.assign(grid.size(), std::numeric_limits<double>::quiet_NaN());
    answers_out.vertices.assign(grid.size(), -1.0f);
    answers_out.cells.assign(cells, -1.0f);
    answers_out.flags.assign(cells, std::uint8_t{0xff});
    const auto read = [&](const char* name, const std::function<Result<void>()>& call) {
        std::string message;
        try {
            if (const Result<void> answer = call(); !answer) message = answer.error().message;
        } catch (const std::exception& thrown) {
            message = std::string("it threw ") + thrown.what();
        } catch (...) {
            message = "it threw something that is no std::exception";
        }
        count(SourceLaw::answers, message.empty(), [&] {
            SourceViolation violation = at(answers_out, grid.corner);
            violation.what = std::string(name) + " of " + std::to_string(grid.columns) + " x " +
                             std::to_string(grid.rows) + " points: " + message;
            return violation;
        });
        return message.empty();
    };
    if (!read("sample()", [&] { return source_.sample(grid, answers_out.heights); }) ||
        !read("vertex_bounds()",
              [&] { return source_.vertex_bounds(grid, answers_out.vertices); })) {
        return false;
    }
    return !has_cells ||
           (read("cell_bounds()", [&] { return source_.cell_bounds(grid, answers_out.cells); }) &&
            read("cell_flags()", [&] { return source_.cell_flags(grid, answers_out.flags); }));
}

double SourceChecks::height(double x, double y) {
    double value = std::numeric_limits<double>::quiet_NaN();
    std::string message = "height() is not finite";
    try {
        value = source_.height(x, y);
    } catch (const std::exception& thrown) {
        message = std::string("height() threw ") + thrown.what();
    } catch (...) {
        message = "height() threw something that is no std::exception";
    }
    count(SourceLaw::finite, std::isfinite(value),
          [&] { return SourceViolation{.x = x, .y = y, .measured = value, .what = message}; });
    return value;
}

// Allowance for the rounding of coordinates and sums in a deviation.
double SourceChecks::rounding(double x, double y, double height, double slope) const {
    return kHeightAccuracy + 0x1p-50 * (std::abs(height) + slope * (std::abs(x) + std::abs(y)));
}

void SourceChecks::check_values(const GridAnswers& answers) {
    const double quantum = source_.lattice().quantum;
    const std::string grid = " of step " + std::to_string(answers.grid.step);
    for (int row = 0; row < answers.grid.rows; ++row) {
        for (int column = 0; column < answers.grid.columns; ++column) {
            const LatticePoint point = answers.point(column, row);
            const auto broken = [&](double claimed, double measured, const char* what) {
                SourceViolation violation = at(answers, point);
                violation.claimed = claimed;
                violation.measured = measured;
                violation.what = what + grid;
                return violation;
            };
            const double sample = answers.heights[answers.at(column, row)];
            const double by_place =
                height(source_.lattice().x(point.x), source_.lattice().y(point.y));
            const bool is_finite = std::isfinite(sample);
            count(SourceLaw::finite, is_finite, [&] { return broken(0.0, sample, "sample"); });
            if (is_finite) {
                const double most = std::min(kMostHeight, kMostQuanta * quantum);
                count(SourceLaw::fits_quanta, std::abs(sample) <= most,
                      [&] { return broken(most, sample, "sample"); });
                count(SourceLaw::height,
                      std::abs(sample - by_place) <= kHeightAccuracy + 0x1p-50 * std::abs(sample),
                      [&] { return broken(sample, by_place, "height() at the sample"); });
            }
            const float bound = answers.vertices[answers.at(column, row)];
            count(SourceLaw::finite, bound >= 0.0f,
                  [&] { return broken(0.0, static_cast<double>(bound), "vertex bound"); });
            if (((row | column) & 1) == 0) {
                count(SourceLaw::no_vertex, bound == 0.0f,
                      [&] { return broken(0.0, static_cast<double>(bound), "bound"); });
            }
            if (!answers.has_cell(column, row)) continue;
            const std::size_t cell = answers.cell_at(column, row);
            count(SourceLaw::finite, answers.cells[cell] >= 0.0f, [&] {
                return broken(0.0, static_cast<double>(answers.cells[cell]), "cell bound");
            });
            count(SourceLaw::finite, answers.flags[cell] <= (cell_outside | cell_filled),
                  [&] { return broken(0.0, answers.flags[cell], "cell flags"); });
        }
    }
}

// Pattern search for a maximum (R. Hooke, T. A. Jeeves, 1961) inside a rectangle.
SourceChecks::Peak SourceChecks::climb(const WorldRect& within, Peak from, double step,
                                       const Measure& measure) {
    // limited rounds: the search need not converge for a source that is not repeatable
    const double smallest = step * 0x1p-12;
    for (int round = 0; round < 64 && step > smallest; ++round) {
        const Peak before = from;
        for (const auto& [dx, dy] : {std::pair{1.0, 0.0},
                                     {-1.0, 0.0},
                                     {0.0, 1.0},
                                     {0.0, -1.0},
                                     {0.7, 0.7},
                                     {-0.7, 0.7},
                                     {0.7, -0.7},
                                     {-0.7, -0.7}}) {
            const double x = std::clamp(before.x + dx * step, within.west, within.east);
            const double y = std::clamp(before.y + dy * step, within.south, within.north);
            const double value = measure(x, y);
            if (value > from.value) from = {value, x, y};
        }
        if (from.value <= before.value) step *= 0.5;
    }
    return from;
}

SourceChecks::Peak SourceChecks::largest_deviation(const LatticeTriangle& triangle,
                                                   double claimed) {
    const Lattice& lattice = source_.lattice();
    std::array<double, 3> xs{}, ys{}, zs{};
    for (std::size_t i = 0; i < 3; ++i) {
        xs[i] = lattice.x(triangle[i].x);
        ys[i] = lattice.y(triangle[i].y);
        zs[i] = height(xs[i], ys[i]);
    }
    const double ax = xs[1] - xs[0], ay = ys[1] - ys[0], bx = xs[2] - xs[0], by = ys[2] - ys[0];
    const double area = ax * by - ay * bx;
    // deviation at a position with barycentric coordinates a and b of the second and third corner; -1 outside the
    // triangle or the measured rectangle
    const auto measure = [&](double x, double y) {
        const double px = x - xs[0], py = y - ys[0];
        const double a = (px * by - py * bx) / area, b = (ax * py - ay * px) / area;
        const bool inside = a >= 0.0 && b >= 0.0 && a + b <= 1.0 && measured_.contains(x, y);
        if (!inside) return -1.0;
        const double z = height(x, y);
        const double off = std::abs(z - (zs[0] + a * (zs[1] - zs[0]) + b * (zs[2] - zs[0])));
        const double size = std::max(std::abs(ax) + std::abs(ay), std::abs(bx) + std::abs(by));
        const double slope = (std::abs(zs[1] - zs[0]) + std::abs(zs[2] - zs[0]) + off) / size;
        return std::max(0.0, off - rounding(x, y, z, slope));
    };
    Peak peak{-1.0, xs[0], ys[0]};
    const auto take = [&](double a, double b) {
        const double x = xs[0] + a * ax + b * bx, y = ys[0] + a * ay + b * by;
        const double value = measure(x, y);
        if (value > peak.value) peak = {value, x, y};
    };
    for (int i = 0; i <= 4; ++i) {
        for (int j = 0; i + j <= 4; ++j) {
            if (i % 4 != 0 || j % 4 != 0) take(0.25 * i, 0.25 * j);
        }
    }
    for (int i = 0; i < settings_.points; ++i) {
        double a = random_.between(0.0, 1.0), b = random_.between(0.0, 1.0);
        if (a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        take(a, b);
    }
    // climbs only if that could find a violation
    if (peak.value > 0.7 * claimed && peak.value <= claimed) {
        const auto [west, east] = std::ranges::minmax(xs);
        const auto [south, north] = std::ranges::minmax(ys);
        peak = climb({west, south, east, north}, peak, 0.125 * (east - west), measure);
    }
    return peak;
}

void SourceChecks::check_triangles(const GridAnswers& answers, const LatticePoint& place,
                                   const std::array<LatticeTriangle, 2>& triangles, float bound,
                                   SourceLaw law, const std::string& what) {
    const auto claimed = static_cast<double>(bound);
    if (!(claimed >= 0.0)) return;  // check_values() reports it as not finite
    for (const LatticeTriangle& triangle : triangles) {
        const Peak peak = largest_deviation(triangle, claimed);
        if (peak.value < 0.0) continue;  // outside the measured rectangle
        if (claimed > 0.0) report_.tightest = std::max(report_.tightest, peak.value / claimed);
        count(law, peak.value <= claimed, [&] {
            SourceViolation violation = at(answers, place);
            violation.x = peak.x;
            violation.y = peak.y;
            violation.claimed = claimed;
            violation.measured = peak.value;
            violation.what = what;
            return violation;
        });
    }
}

void SourceChecks::check_bounds(const GridAnswers& answers) {
    const Lattice& lattice = source_.lattice();
    const std::string size = metres(lattice.spacing * static_cast<double>(answers.grid.step));
    const std::string of_vertex = "vertex of spacing " + size, of_cell = "cell of side " + size;
    for (int row = 0; row < answers.grid.rows; ++row) {
        for (int column = 0; column < answers.grid.columns; ++column) {
            const LatticePoint point = answers.point(column, row);
            if (((row | column) & 1) != 0) {
                check_triangles(answers, point, diamond(point, answers.grid.step),
                                answers.vertices[answers.at(column, row)], SourceLaw::vertex_bound,
                                of_vertex);
            }
            if (!answers.has_cell(column, row)) continue;
            check_triangles(answers, point, cut_square(point, answers.grid.step),
                            answers.cells[answers.cell_at(column, row)], SourceLaw::cell_bound,
                            of_cell);
        }
    }
}

// Laws that relate a source's answers to each other, and laws about rectangles and distances.

namespace {

// Compare bits: -0 differs from 0, and NaN equals itself.
bool same(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool same(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

// Checks that the bound `below` of a child is at most `slack` times the bound of the vertex at (column, row).
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

// Whether a point is in the world. Beyond it meshes have no vertices, and bounds need not be nested.
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

// Compares the answers at each point of `some` with those of `other` there, `shift` columns and rows further.
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
    // west and south are even, so that the corner remains a multiple of twice the step
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
    } catch (...) {
        message = "it threw something that is no std::exception";
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
    // slightly less, to allow for the rounding of positions
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
