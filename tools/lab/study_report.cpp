// SPDX-License-Identifier: MIT
#include "assets.h"
#include "lab/study.h"
#include "program/output_file.h"
#include "program/summary.h"

#include <fmt/format.h>

#include <utility>

namespace terrane::tools {
namespace {

nlohmann::ordered_json power_or_null(const std::optional<PowerLaw>& law) {
    const bool has_power = law && !law->is_mostly_fixed();
    return has_power ? nlohmann::ordered_json(law->power) : nlohmann::ordered_json();
}

nlohmann::ordered_json to_json(const CrowdTotals& totals) {
    return {{"queries", totals.queries},
            {"positive_queries", totals.positive_queries},
            {"query_ms", totals.mean_query_ms()},
            {"positive_ms", totals.mean_positive_ms()},
            {"update_ms", totals.mean_update_ms()},
            {"boxes_ms", totals.mean_boxes_ms()},
            {"pairs_a_query", totals.mean_pairs()},
            {"boxes_a_query", totals.mean(totals.boxes)}};
}

void add_comparisons(const StudyTable& table, std::string& text) {
    const std::vector<Comparison> comparisons = compare_with_published(table);
    if (comparisons.empty()) return;
    text += "| | published, us | ours, us | published / ours | why they differ |\n";
    text += "|---|---|---|---|---|\n";
    for (const Comparison& each : comparisons) {
        text += fmt::format("| {} | {} | {} | {} | {} |\n", each.what,
                            short_text(1e3 * each.published_ms), short_text(1e3 * each.our_ms),
                            short_text(each.published_ms / each.our_ms), each.reason);
    }
    text += "\n";
}

void add_measurements(const StudyTable& table, std::string& text) {
    text += fmt::format(
        "| {} | series | queries | positive | positive, % | query, us | positive query, us | "
        "update, us | boxes, us | pairs a query |\n",
        table.x_name);
    text += "|---|---|---|---|---|---|---|---|---|---|\n";
    for (const StudyPoint& point : table.points) {
        for (std::size_t i = 0; i < table.series.size(); ++i) {
            const CrowdTotals& totals = point.measured[i];
            if (totals.queries == 0) continue;
            text += fmt::format(
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", point.x,
                table.series[i].name, totals.queries, totals.positive_queries,
                short_text(100.0 * totals.positive_share()),
                short_text(1e3 * totals.mean_query_ms()),
                totals.positive_queries == 0 ? "" : short_text(1e3 * totals.mean_positive_ms()),
                short_text(1e3 * totals.mean_update_ms()), short_text(1e3 * totals.mean_boxes_ms()),
                short_text(totals.mean_pairs()));
        }
    }
    text += "\n";
}

}  // namespace

nlohmann::ordered_json to_json(const StudyTable& table) {
    nlohmann::ordered_json json;
    json["key"] = table.key;
    json["title"] = table.title;
    json["x_name"] = table.x_name;
    json["text"] = table.text;
    json["findings"] = study_findings(table);
    json["comparisons"] = nlohmann::ordered_json::array();
    for (const Comparison& each : compare_with_published(table)) {
        json["comparisons"].push_back({{"what", each.what},
                                       {"published_ms", each.published_ms},
                                       {"our_ms", each.our_ms},
                                       {"reason", each.reason}});
    }
    json["left_out"] = nlohmann::ordered_json::array();
    for (const LeftOut& each : table.left_out) {
        json["left_out"].push_back(
            {{"x", each.x}, {"series", each.series}, {"estimated_s", each.seconds}});
    }
    json["points"] = nlohmann::ordered_json::array();
    for (const StudyPoint& point : table.points) {
        nlohmann::ordered_json row;
        row["x"] = point.x;
        if (point.published_query_ms) row["published_query_ms"] = *point.published_query_ms;
        if (point.published_update_ms) row["published_update_ms"] = *point.published_update_ms;
        for (std::size_t i = 0; i < table.series.size(); ++i) {
            if (point.measured[i].queries > 0)
                row[table.series[i].name] = to_json(point.measured[i]);
        }
        json["points"].push_back(std::move(row));
    }
    json["slopes"] = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < table.series.size(); ++i) {
        json["slopes"][table.series[i].name] = {
            {"published_places", number_or_null(query_slope(table, i, true))},
            {"all", number_or_null(query_slope(table, i, false))},
            {"without_fixed_cost", power_or_null(time_law(table, i, &CrowdTotals::mean_query_ms))},
            {"step_without_fixed_cost",
             power_or_null(time_law(table, i, &CrowdTotals::mean_step_ms))}};
    }
    return json;
}

std::string study_markdown(std::span<const StudyTable> tables) {
    std::string text;
    for (const StudyTable& table : tables) {
        text += fmt::format("## {}\n\n{}\n\n", table.title, table.text);
        add_comparisons(table, text);
        for (const std::string& finding : study_findings(table)) text += "- " + finding + "\n";
        text += "\n";
        add_measurements(table, text);
    }
    return text;
}

Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables) {
    nlohmann::ordered_json data;
    data["tables"] = nlohmann::ordered_json::array();
    for (const StudyTable& table : tables) data["tables"].push_back(to_json(table));
    return write_report(place, header, std::move(data), assets::study_js);
}

Result<void> write_study_markdown(const OutputPlace& place, std::span<const StudyTable> tables) {
    TERRANE_TRY(OutputFile file, OutputFile::create(place));
    file.write(study_markdown(tables));
    return file.commit();
}

}  // namespace terrane::tools
