// SPDX-License-Identifier: MIT
#include "page/paging_table.h"

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>

namespace terrane::tools {
namespace {

constexpr double kMegabyte = 0x1p20;

nlohmann::ordered_json number_or_null(const std::optional<double>& value) {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

double ratio(double value, double of) {
    if (of > 0.0) return value / of;
    return value > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
}

void judge(PagingVerdict& verdict) {
    const auto misses = [&](const char* key, bool is_missed) {
        if (is_missed) verdict.missed.emplace_back(key);
    };
    const PagingTotals* const ours = verdict.deadline ? &verdict.deadline->run.totals : nullptr;
    const PagingTotals* const nearest = verdict.distance ? &verdict.distance->run.totals : nullptr;
    const PagingTotals* const oracle = verdict.oracle ? &verdict.oracle->run.totals : nullptr;
    if (ours && nearest && oracle && oracle->late_frames == 0) {
        verdict.late_ratio = ratio(static_cast<double>(ours->late_frames),
                                   static_cast<double>(nearest->late_frames));
        misses("late_frames", *verdict.late_ratio > PagingVerdict::kMostLate);
    }
    if (ours && oracle && oracle->late_frames > 0) {
        verdict.excess_ratio = ratio(ours->excess_error_px_s, oracle->excess_error_px_s);
        misses("excess_error_px_s", *verdict.excess_ratio > PagingVerdict::kMostExcess);
    }
    if (ours) {
        misses("wasted_share", ours->wasted_share() > PagingVerdict::kMostWasted &&
                                   !verdict.deadline->has_unannounced_jumps);
    }
    if (ours && oracle) misses("contact_late", ours->contact_late > 0 && oracle->contact_late == 0);
    const double ceiling = verdict.cell.memory_mb * kMegabyte;
    const std::array all{ours, nearest, oracle};
    misses("peak_bytes", std::ranges::any_of(all, [ceiling](const PagingTotals* totals) {
               return totals && static_cast<double>(totals->peak_bytes) > ceiling;
           }));
}

}  // namespace

bool is_better(const PagingTotals& totals, const PagingTotals& other) {
    return std::tie(totals.late_frames, totals.excess_error_px_s) <
           std::tie(other.late_frames, other.excess_error_px_s);
}

nlohmann::ordered_json to_json(const PagingRow& row) {
    const PagingTotals& totals = row.run.totals;
    nlohmann::ordered_json json;
    json["path"] = row.cell.path;
    json["speed"] = number_or_null(row.cell.speed);
    json["altitude"] = number_or_null(row.cell.altitude);
    json["policy"] = name_of(row.policy);
    json["radius"] = row.policy == PagingChoice::distance ? nlohmann::ordered_json(row.radius)
                                                          : nlohmann::ordered_json(nullptr);
    json["latency_ms"] = row.cell.latency_ms;
    json["bandwidth_mb"] = row.cell.bandwidth_mb;
    json["memory_mb"] = row.cell.memory_mb;
    json["frames"] = totals.frames;
    json["late_frames"] = totals.late_frames;
    json["late_share"] = totals.late_share();
    json["excess_error_px_s"] = totals.excess_error_px_s;
    json["error_px_max"] = totals.error_px_max;
    json["bytes_loaded"] = totals.bytes_loaded;
    json["bytes_wasted"] = totals.bytes_wasted;
    json["wasted_share"] = totals.wasted_share();
    json["peak_bytes"] = totals.peak_bytes;
    json["contact_late"] = totals.contact_late;
    json["body_frames"] = totals.body_frames;
    json["loaded"] = totals.loaded;
    json["reloads"] = totals.reloads;
    json["evicted"] = totals.evicted;
    json["hard_evictions"] = totals.hard_evictions;
    json["cancelled"] = totals.cancelled;
    json["failed"] = totals.failed;
    json["timed_out"] = totals.timed_out;
    json["over_ceiling"] = totals.over_ceiling;
    return json;
}

std::vector<PagingVerdict> judge(std::span<const PagingRow> rows) {
    std::vector<PagingVerdict> verdicts;
    for (const PagingRow& row : rows) {
        auto verdict = std::ranges::find(verdicts, row.cell, &PagingVerdict::cell);
        if (verdict == verdicts.end()) {
            verdicts.emplace_back().cell = row.cell;
            verdict = verdicts.end() - 1;
        }
        switch (row.policy) {
            case PagingChoice::deadline:
                verdict->deadline = &row;
                break;
            case PagingChoice::distance:
                verdict->distance = &row;
                break;
            case PagingChoice::oracle:
                verdict->oracle = &row;
                break;
        }
    }
    for (PagingVerdict& verdict : verdicts) judge(verdict);
    return verdicts;
}

}  // namespace terrane::tools
