// SPDX-License-Identifier: MIT
// Writes the table of extremes to the standard output, as Markdown (chapter Extremes of docs/measurements.md), and its
// progress to the standard error. With --long it takes a quarter of an hour.
//
//     extremes_table [--long] [ROW...]
#include "extremes/extreme_row.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

namespace {

using terrane::extremes::ExtremeRow;
using terrane::extremes::MeasuredRow;

/// Whether a row was asked for: all are where none is named.
bool is_wanted(const ExtremeRow& row, const std::vector<std::string>& names) {
    return names.empty() || std::find(names.begin(), names.end(), row.name) != names.end();
}

/// Seconds since the first call.
double elapsed() {
    using Clock = std::chrono::steady_clock;
    static const Clock::time_point start = Clock::now();
    return std::chrono::duration<double>(Clock::now() - start).count();
}

int write_table(const std::vector<std::string>& names, bool is_long) {
    std::vector<MeasuredRow> table;
    bool is_kept = true;
    for (const ExtremeRow& row : terrane::extremes::all_rows()) {
        if (!is_wanted(row, names)) continue;
        table.push_back(terrane::extremes::measure(row, is_long, [&](double value) {
            std::fprintf(stderr, "%8.1f s  %s: %.6g\n", elapsed(), row.name.c_str(), value);
        }));
        const MeasuredRow& measured = table.back();
        for (std::size_t i = 0; i < measured.values.size(); ++i) {
            if (keeps_promise(row, measured.figures[i])) continue;
            is_kept = false;
            std::fprintf(stderr, "extremes_table: %s at %.6g is %.6g, more than %.6g\n",
                         row.name.c_str(), measured.values[i], measured.figures[i], row.limit);
        }
    }
    std::fprintf(stderr, "%8.1f s  done\n", elapsed());
    const std::string text = to_markdown(table);
    const bool is_written =
        std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
    return is_kept && is_written ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    bool is_long = false;
    std::vector<std::string> names;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        const std::vector<ExtremeRow>& rows = terrane::extremes::all_rows();
        const auto has_name = [&](const ExtremeRow& row) { return row.name == argument; };
        if (argument == "--long") {
            is_long = true;
        } else if (std::any_of(rows.begin(), rows.end(), has_name)) {
            names.push_back(argument);
        } else {
            std::fprintf(stderr, "extremes_table: no row or flag is called %s\n", argv[i]);
            return 2;
        }
    }
    return write_table(names, is_long);
}
