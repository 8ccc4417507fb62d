// SPDX-License-Identifier: MIT
#include "contact_table.h"

#include <cstdio>

namespace terrane::bench {
namespace {

std::string format(const char* pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}

std::string as_time(double ns) {
    if (ns < 1e3) return format("%.3g ns", ns);
    if (ns < 1e6) return format("%.3g us", 1e-3 * ns);
    return format("%.4g ms", 1e-6 * ns);
}

// "44 us, 5.2x (>= 5: met)": a peer's time, and the speed of Terrane relative to it.
std::string as_peer(const Score& ours, const Score& peer, double wanted) {
    if (!peer.ns) return "-";
    const double ratio = *peer.ns / *ours.ns;
    std::string text = as_time(*peer.ns) + ", " + format("%.3g", ratio) + "x";
    if (wanted > 0.0) {
        text += format(" (>= %g: ", wanted) +
                (ratio >= wanted ? "met)" : "missed by " + format("%.3g", wanted / ratio) + "x)");
    }
    return text;
}

}  // namespace

void print_table(const std::vector<std::string>& engines, const std::vector<Row>& rows) {
    std::printf("\n%-44s %10s %8s %-15s", "median of a query", engines[0].c_str(), "target", "");
    for (std::size_t peer = 1; peer < engines.size(); ++peer) {
        std::printf(" | %-38s", (engines[peer] + ", times as slow").c_str());
    }
    std::printf("\n");
    for (const Row& row : rows) {
        const double ours = *row.scores[0].ns;
        std::string verdict;
        if (row.target_ns > 0.0) {
            verdict = ours <= row.target_ns
                          ? "met"
                          : "missed by " + format("%.3g", ours / row.target_ns) + "x";
        }
        std::printf("%-44s %10s %8s %-15s", row.question.c_str(), as_time(ours).c_str(),
                    row.target_ns > 0.0 ? as_time(row.target_ns).c_str() : "", verdict.c_str());
        for (std::size_t peer = 1; peer < engines.size(); ++peer) {
            std::printf(
                " | %-38s",
                as_peer(row.scores[0], row.scores[peer], row.wanted_ratios[peer - 1]).c_str());
        }
        std::printf("\n");
    }

    std::printf("\n%-44s %8s %10s", "found, missed", "queries", "touching");
    for (const std::string& engine : engines) std::printf(" %20s", engine.c_str());
    std::printf("\n");
    for (const Row& row : rows) {
        std::printf("%-44s %8zu %10s", row.question.c_str(), row.queries,
                    row.has_oracle ? std::to_string(row.touching).c_str() : "");
        for (const Score& score : row.scores) {
            std::string text = "-";
            if (score.ns) {
                text = std::to_string(score.hits);
                if (row.has_oracle) text += ", " + std::to_string(score.missed);
            }
            std::printf(" %20s", text.c_str());
        }
        std::printf("\n");
    }
}

}  // namespace terrane::bench
