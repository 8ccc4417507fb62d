// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace terrane::bench {

/// An engine's result of a query.
struct Score {
    std::optional<double> ns;  ///< median over the rounds, a query; none: no such query
    std::size_t hits = 0;      ///< queries with a contact or a hit
    std::size_t missed = 0;    ///< contacts of the oracle that it does not report
};

/// A query, Terrane's targets, and a score of each engine in the order of the columns.
struct Row {
    std::string question;
    double target_ns = 0.0;             ///< 0: none
    std::vector<double> wanted_ratios;  ///< target speed relative to each peer; 0: none
    std::size_t queries = 0;
    bool has_oracle = false;
    std::size_t touching = 0;        ///< of the queries, by the oracle of Terrane's surface
    std::vector<Score> scores = {};  ///< Terrane's first
};

/// Prints one table of times and one of what was found. `engines` names the columns.
void print_table(const std::vector<std::string>& engines, const std::vector<Row>& rows);

}  // namespace terrane::bench
