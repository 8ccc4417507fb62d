// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"

#include <bit>
#include <cmath>
#include <cstdint>
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

}  // namespace terrane::extremes
