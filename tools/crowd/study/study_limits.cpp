// SPDX-License-Identifier: MIT
#include "crowd/study/study_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace terrane::tools {
namespace {

// A scheme is slow where it takes this many times as long as the fastest one.
constexpr double kSlow = 2.0;

std::size_t fastest_at(const StudyPoint& point) {
    std::size_t fastest = point.measured.size();
    for (std::size_t i = 0; i < point.measured.size(); ++i) {
        if (point.measured[i].queries == 0) continue;
        if (fastest == point.measured.size() ||
            point.measured[i].mean_step_ms() < point.measured[fastest].mean_step_ms()) {
            fastest = i;
        }
    }
    return fastest;
}

// Time of a step over that of the fastest scheme; absent where the series was left out.
std::optional<double> slowness(const StudyPoint& point, std::size_t series) {
    const std::size_t fastest = fastest_at(point);
    if (fastest == point.measured.size() || point.measured[series].queries == 0) {
        return std::nullopt;
    }
    return point.measured[series].mean_step_ms() / point.measured[fastest].mean_step_ms();
}

void add_item(std::string& list, const std::string& item) {
    list += (list.empty() ? "" : ", ") + item;
}

// Ratio of the last measured step to the first of each series.
void add_growth(const StudyTable& table, std::vector<std::string>& findings) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const StudyPoint* last = nullptr;
        for (const StudyPoint& point : table.points) {
            if (point.measured[i].queries > 0) last = &point;
        }
        const CrowdTotals& first = table.points.front().measured[i];
        if (last == nullptr || first.queries == 0) continue;
        std::string item =
            fmt::format("{} {}", table.series[i],
                        short_text(last->measured[i].mean_step_ms() / first.mean_step_ms()));
        if (last != &table.points.back()) item += fmt::format(" (to {})", last->x);
        add_item(text, item);
    }
    if (text.empty()) return;
    findings.push_back(fmt::format(
        "From {} to {} {} an update and a query together take this many times as long: {}.",
        table.points.front().x, table.points.back().x, table.x_name, text));
}

void add_fastest(const StudyTable& table, std::vector<std::string>& findings) {
    std::string text;
    for (const StudyPoint& point : table.points) {
        const std::size_t fastest = fastest_at(point);
        if (fastest == point.measured.size()) continue;
        add_item(text, fmt::format("{} at {} ({} ms)", table.series[fastest], point.x,
                                   short_text(point.measured[fastest].mean_step_ms())));
    }
    if (!text.empty()) findings.push_back("The fastest scheme: " + text + ".");
}

// A scheme needs similar bodies if it falls behind the fastest one as they differ more.
void judge_similarity(const StudyTable& table, std::vector<std::string>& findings) {
    std::string need, need_not;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<double> alike = slowness(table.points.front(), i);
        if (!alike) continue;
        std::optional<double> from, last;
        for (const StudyPoint& point : table.points) {
            const std::optional<double> now = slowness(point, i);
            if (!now || &point == &table.points.front()) continue;
            last = *now / *alike;
            if (*last <= kSlow) {
                from.reset();
            } else if (!from) {
                from = point.x;
            }
        }
        if (from) {
            add_item(need,
                     fmt::format("{} {} (from {} on)", table.series[i], short_text(*last), *from));
        } else if (last) {
            add_item(need_not, fmt::format("{} {}", table.series[i], short_text(*last)));
        }
    }
    if (need.empty() && need_not.empty()) return;
    findings.push_back(fmt::format(
        "\"Bodies of similar size and aspect\", as the study concludes: how far each scheme falls "
        "behind the fastest one, over the same for similar bodies. More than {} times, so that it "
        "needs similar bodies: {}. Not so: {}.",
        kSlow, need.empty() ? "none" : need, need_not.empty() ? "none" : need_not));
}

// Boxes along the axes fit long bodies badly: pairs of boxes without contact are the cost of every scheme.
void add_pairs(const StudyTable& table, std::vector<std::string>& findings) {
    const auto of = [](const StudyPoint& point) -> const CrowdTotals* {
        for (const CrowdTotals& totals : point.measured) {
            if (totals.queries > 0) return &totals;
        }
        return nullptr;
    };
    const CrowdTotals* const first = of(table.points.front());
    const CrowdTotals* const last = of(table.points.back());
    if (first == nullptr || last == nullptr) return;
    const auto text = [](const CrowdTotals& totals) {
        return fmt::format(
            "{} pairs of overlapping boxes a query, {} % of them in contact",
            short_text(totals.mean_pairs()),
            short_text(totals.pairs == 0 ? 0.0
                                         : 100.0 * static_cast<double>(totals.touching) /
                                               static_cast<double>(totals.pairs)));
    };
    findings.push_back(fmt::format("What every scheme has to find: at {} {}; at {} {}.",
                                   table.points.front().x, text(*first), table.points.back().x,
                                   text(*last)));
}

void add_left_out(const StudyTable& table, std::vector<std::string>& findings) {
    if (table.left_out.empty()) return;
    std::string text;
    for (const LeftOut& left : table.left_out) {
        add_item(text,
                 fmt::format("{} at {} ({} s)", left.series, left.x, short_text(left.seconds)));
    }
    findings.push_back(fmt::format(
        "Left out, because {} queries would take longer than {} s by the growth from fewer "
        "bodies: {}.",
        kFewestQueries, short_text(table.most_seconds), text));
}

void add_powers(const StudyTable& table, std::vector<std::string>& findings) {
    std::string text;
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        const std::optional<PowerLaw> law = time_law(table, i, &CrowdTotals::mean_step_ms);
        if (law) add_item(text, fmt::format("{} {:.2f}", table.series[i], law->power));
    }
    if (text.empty()) return;
    findings.push_back(fmt::format(
        "An update and a query together grow with this power of the {}, the fixed cost apart: {}.",
        table.x_name, text));
}

}  // namespace

void StepTimes::add(const std::string& kind, std::size_t bodies, double seconds) {
    if (seconds > 0.0) seconds_[kind][bodies] = seconds;
}

std::optional<double> StepTimes::power_at(const std::string& kind, std::size_t bodies) const {
    const auto known = seconds_.find(kind);
    if (known == seconds_.end()) return std::nullopt;
    auto larger = known->second.lower_bound(bodies);
    if (std::distance(known->second.begin(), larger) < 2) return std::nullopt;
    const auto [count, seconds] = *--larger;
    const auto [fewer, sooner] = *--larger;
    return std::log(seconds / sooner) /
           std::log(static_cast<double>(count) / static_cast<double>(fewer));
}

std::optional<double> StepTimes::seconds_at(const std::string& kind, const std::string& similar,
                                            std::size_t bodies) const {
    constexpr double kLeastPower = 1.0, kMostPower = 2.0;
    const auto known = seconds_.find(kind);
    if (known == seconds_.end()) return std::nullopt;
    auto nearest = known->second.lower_bound(bodies);
    if (nearest == known->second.begin()) return std::nullopt;
    const auto [count, seconds] = *--nearest;
    std::optional<double> power = power_at(kind, bodies);
    if (!power) power = power_at(similar, bodies);
    return seconds * std::pow(static_cast<double>(bodies) / static_cast<double>(count),
                              std::clamp(power.value_or(kMostPower), kLeastPower, kMostPower));
}

void judge_limits(const StudyTable& table, std::vector<std::string>& findings) {
    if (table.key == "many") {
        add_powers(table, findings);
    } else {
        judge_similarity(table, findings);
    }
    add_growth(table, findings);
    add_fastest(table, findings);
    add_pairs(table, findings);
    add_left_out(table, findings);
}

}  // namespace terrane::tools
