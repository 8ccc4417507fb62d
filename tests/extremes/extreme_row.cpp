// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

namespace terrane::extremes {
namespace {

/// The place of a double among all doubles in ascending order; both zeros are 0.
std::int64_t rank_of(double value) {
    const auto bits = std::bit_cast<std::int64_t>(value);
    return bits >= 0 ? bits : std::numeric_limits<std::int64_t>::min() - bits;
}

double at_rank(std::int64_t rank) {
    return std::bit_cast<double>(rank >= 0 ? rank
                                           : std::numeric_limits<std::int64_t>::min() - rank);
}

/// A value between two, or one of them where there is none.
double between(double a, double b, bool is_whole) {
    if (is_whole) return std::floor(0.5 * (a + b));
    return at_rank(std::midpoint(rank_of(a), rank_of(b)));
}

void append(std::vector<ExtremeRow>& rows, std::vector<ExtremeRow> more) {
    rows.insert(rows.end(), std::make_move_iterator(more.begin()),
                std::make_move_iterator(more.end()));
}

}  // namespace

FoundEnd find_end(const ExtremeRow& row, const RangeEnd& end) {
    FoundEnd found{end.accepted, end.refused, row.refusal(end.refused), {}};
    found.far_message = found.message;
    for (;;) {
        const double middle = between(found.last_accepted, found.first_refused, end.is_whole);
        if (middle == found.last_accepted || middle == found.first_refused) return found;
        if (std::string message = row.refusal(middle); message.empty()) {
            found.last_accepted = middle;
        } else {
            found.first_refused = middle;
            found.message = std::move(message);
        }
    }
}

bool keeps_promise(const ExtremeRow& row, double figure) {
    return std::isfinite(figure) && figure <= row.limit;
}

const std::vector<ExtremeRow>& all_rows() {
    static const std::vector<ExtremeRow> rows = [] {
        std::vector<ExtremeRow> made = ground_rows();
        append(made, world_rows());
        append(made, motion_rows());
        append(made, body_rows());
        append(made, time_rows());
        append(made, view_rows());
        return made;
    }();
    return rows;
}

namespace {

constexpr const char* kHead = R"(## Extremes

Each quantity is swept from one end of its range to the other. Its section has the promise, and a table of the measured figure (second row)
at values of the quantity (first row). Below the table are, for each end of the range, the last accepted and the first refused value, and
after "Far beyond" the message for a value far outside the range. The tables are the output of

```sh
build/release/tests/extremes/extremes_table --long > out/extremes.md   # a quarter of an hour
```

The rows are defined in [tests/extremes](../tests/extremes/rows). The tests `ExtremeRows.*` check that every figure keeps its promise and
that every refused value gets its message. The first refused value is the next double or whole number after the last accepted one. Figures
are divided by the promised limit unless a unit is named, so that 1 uses all of it.

| quantity | measured from | to | worst figure | promised | accepted from | to |
|---|---|---|---|---|---|---|
)";

std::string text(const char* format, double value) {
    std::array<char, 40> out{};
    std::snprintf(out.data(), out.size(), format, value);
    return out.data();
}

/// All digits where neighbouring values are told apart.
std::string end_text(double value) {
    const std::string brief = text("%.6g", value);
    return std::strtod(brief.c_str(), nullptr) == value ? brief : text("%.17g", value);
}

std::string limit_text(const ExtremeRow& row) { return figure_text(row.limit); }

/// The end of a row on one side: its last accepted value, or a dash.
std::string side_text(const MeasuredRow& measured, bool is_upper) {
    for (std::size_t i = 0; i < measured.ends.size(); ++i) {
        const bool ends_above = measured.row->ends[i].refused > measured.row->ends[i].accepted;
        if (ends_above == is_upper) return end_text(measured.ends[i].last_accepted);
    }
    return "-";
}

/// The largest figure; one that is no number is worse than all others.
double worst_figure(const MeasuredRow& measured) {
    double worst = -std::numeric_limits<double>::infinity();
    for (const double figure : measured.figures) {
        if (!(figure <= worst)) worst = figure;
        if (std::isnan(worst)) break;
    }
    return worst;
}

std::string summary_of(const MeasuredRow& measured) {
    const auto [low, high] = std::minmax_element(measured.values.begin(), measured.values.end());
    return "| " + measured.row->swept + " | " + figure_text(*low) + " | " + figure_text(*high) +
           " | " + figure_text(worst_figure(measured)) + " | " + limit_text(*measured.row) + " | " +
           side_text(measured, false) + " | " + side_text(measured, true) + " |\n";
}

std::string section_of(const MeasuredRow& measured) {
    const ExtremeRow& row = *measured.row;
    std::string out = "\n#### " + row.swept + "\n\n" + row.promise + " Measured: " + row.figure +
                      "; at most " + limit_text(row) + ".\n\n|";
    for (const double value : measured.values)
        out.append(" ").append(figure_text(value)).append(" |");
    out += "\n|";
    for (std::size_t i = 0; i < measured.values.size(); ++i) out += "---|";
    out += "\n|";
    for (const double figure : measured.figures)
        out.append(" ").append(figure_text(figure)).append(" |");
    out += "\n";
    if (!measured.ends.empty() || !row.note.empty()) out += "\n";
    for (const FoundEnd& end : measured.ends) {
        out += "- " + end_text(end.last_accepted) + " is accepted, " + end_text(end.first_refused) +
               " refused. Far beyond: \"" + end.far_message + "\".\n";
    }
    if (!row.note.empty()) out += "- " + row.note + "\n";
    return out;
}

}  // namespace

MeasuredRow measure(const ExtremeRow& row, bool is_long,
                    const std::function<void(double)>& begins) {
    MeasuredRow measured{&row, row.values, {}, {}};
    if (is_long) {
        measured.values.insert(measured.values.end(), row.long_values.begin(),
                               row.long_values.end());
    }
    for (const double value : measured.values) {
        if (begins) begins(value);
        measured.figures.push_back(row.measure(value));
    }
    for (const RangeEnd& end : row.ends) measured.ends.push_back(find_end(row, end));
    return measured;
}

std::string figure_text(double value) { return text("%.3g", value); }

std::string to_markdown(std::span<const MeasuredRow> rows) {
    std::string out = kHead;
    for (const MeasuredRow& row : rows) out += summary_of(row);
    std::string topic;
    for (const MeasuredRow& row : rows) {
        if (row.row->topic != topic) out += "\n### " + row.row->topic + "\n";
        topic = row.row->topic;
        out += section_of(row);
    }
    return out;
}

}  // namespace terrane::extremes
