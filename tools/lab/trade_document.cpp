// SPDX-License-Identifier: MIT
#include "lab/trade_document.h"

#include "assets.h"
#include "frames/flight_log.h"
#include "program/options.h"
#include "program/output_file.h"
#include "program/summary.h"

#include <terrane/base/version.h>

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTradeFormat = "terrane trade";
constexpr int kFormatVersion = 1;

bool has_string(const Json& json, const char* key) {
    return json.contains(key) && json[key].is_string();
}

// The first fault of a figure; "" for none.
std::string fault_of_figure(const Json& figure) {
    if (!figure.is_object()) return "a figure is no object";
    for (const char* key : {"median", "low", "high", "repetitions"}) {
        if (!figure.contains(key) || !figure[key].is_number()) {
            return fmt::format("a figure has no number '{}'", key);
        }
    }
    if (figure.contains("ratio") && !figure["ratio"].is_number()) return "a ratio is no number";
    return "";
}

// The first fault of a table; "" for none.
std::string fault_of_table(const Json& table) {
    if (!table.is_object()) return "a table is no object";
    for (const char* key : {"key", "title", "axis", "text", "terrain", "cost", "loss"}) {
        if (!has_string(table, key)) return fmt::format("a table has no text '{}'", key);
    }
    for (const char* key : {"columns", "rows", "findings"}) {
        if (!table.contains(key) || !table[key].is_array()) {
            return fmt::format("a table has no list '{}'", key);
        }
    }
    for (const Json& column : table["columns"]) {
        if (!column.is_object() || !has_string(column, "key") || !has_string(column, "title") ||
            !has_string(column, "unit")) {
            return "a column has no key, title or unit";
        }
    }
    for (const Json& row : table["rows"]) {
        if (!row.is_object() || !has_string(row, "label") || !has_string(row, "command") ||
            !row.contains("figures") || !row["figures"].is_object()) {
            return "a row has no label, command or figures";
        }
        if (!row.contains("presets") || !row["presets"].is_array()) return "a row has no presets";
        for (const Json& figure : row["figures"]) {
            if (std::string fault = fault_of_figure(figure); !fault.empty()) return fault;
        }
    }
    return "";
}

std::string fault_of_document(const Json& document) {
    if (document.is_discarded()) return "it is no JSON";
    if (!document.is_object() || document.value("format", Json()) != kTradeFormat) {
        return fmt::format("it has no \"format\": \"{}\"", kTradeFormat);
    }
    if (document.value("format_version", Json()) != kFormatVersion) {
        return fmt::format("its format_version is not {}", kFormatVersion);
    }
    if (!document.contains("machine") || !document["machine"].is_object()) {
        return "it has no machine";
    }
    if (!document.contains("reference_loop_ms") ||
        !fault_of_figure(document["reference_loop_ms"]).empty()) {
        return "it has no reference_loop_ms";
    }
    if (!document.contains("tables") || !document["tables"].is_array()) return "it has no tables";
    for (const Json& table : document["tables"]) {
        if (std::string fault = fault_of_table(table); !fault.empty()) return fault;
    }
    return "";
}

// The figure of a document for a dial, terrain, label and column, or null.
const Json* find_figure(const Json& document, const Json& table, const std::string& label,
                        const std::string& column) {
    for (const Json& other : document["tables"]) {
        if (other["key"] != table["key"] || other["terrain"] != table["terrain"]) continue;
        for (const Json& row : other["rows"]) {
            if (row["label"] == label && row["figures"].contains(column)) {
                return &row["figures"][column];
            }
        }
    }
    return nullptr;
}

Json quotient(const Json& figure, const Json& other, const char* key) {
    if (!figure.contains(key) || !other.contains(key)) return nullptr;
    const double under = figure[key].get<double>();
    return under > 0.0 ? Json(other[key].get<double>() / under) : Json(nullptr);
}

Json median_or_null(const std::vector<double>& values) {
    return values.empty() ? Json(nullptr) : Json(median(values));
}

}  // namespace

Json to_json(const TradeDocument& document) {
    const Machine machine = this_machine();
    Json known = Json::array(), tables = Json::array(), idle_dials = Json::array();
    for (const Preset& preset : presets()) {
        Json flags;
        for (const PresetFlag& each : preset.flags) flags[std::string(each.flag)] = each.value;
        known.push_back({{"name", preset.name}, {"flags", flags}});
    }
    for (const TradeTable& table : document.tables) tables.push_back(to_json(table));
    for (const IdleDial& dial : document.idle_dials) {
        idle_dials.push_back(
            {{"key", dial.key}, {"terrain", dial.terrain}, {"reason", dial.reason}});
    }
    return {{"format", kTradeFormat},
            {"format_version", kFormatVersion},
            {"command", document.command_line},
            {"quick", document.is_quick},
            {"seconds", document.seconds},
            {"machine",
             {{"processor", machine.processor},
              {"threads", machine.threads},
              {"compiler", machine.compiler},
              {"build", machine.build},
              {"version", library_version()}}},
            {"reference_loop_ms", to_json(document.reference_ms, "")},
            {"presets", known},
            {"tables", tables},
            {"idle_dials", idle_dials}};
}

CommandResult<Json> read_trade_document(const std::string& path) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file.is_open() || file.bad()) {
        return failure(fmt::format("cannot read '{}': {}", path, std::strerror(errno)));
    }
    Json document = Json::parse(text, nullptr, false);
    if (const std::string fault = fault_of_document(document); !fault.empty()) {
        return failure(fmt::format("'{}' is no trade.json of terrane trade: {}", path, fault));
    }
    return document;
}

Json compare_documents(const Json& a, const Json& b) {
    Json figures = Json::array();
    std::vector<double> times, ratios;
    for (const Json& table : a["tables"]) {
        for (const Json& row : table["rows"]) {
            for (const Json& column : table["columns"]) {
                const auto label = row["label"].get<std::string>();
                const auto key = column["key"].get<std::string>();
                if (!row["figures"].contains(key)) continue;
                const Json& figure = row["figures"][key];
                const Json* other = find_figure(b, table, label, key);
                if (other == nullptr) continue;
                const Json over = quotient(figure, *other, "median");
                const Json ratio = quotient(figure, *other, "ratio");
                const bool is_time = figure.contains("ratio");
                if (is_time && over.is_number()) times.push_back(over.get<double>());
                if (ratio.is_number()) ratios.push_back(ratio.get<double>());
                Json entry{{"dial", table["key"]},    {"terrain", table["terrain"]},
                           {"label", label},          {"column", key},
                           {"unit", column["unit"]},  {"a", figure["median"]},
                           {"b", (*other)["median"]}, {"b_over_a", over}};
                if (is_time) entry["ratio_b_over_a"] = ratio;
                figures.push_back(std::move(entry));
            }
        }
    }
    Json json;
    json["a"] = a["machine"];
    json["b"] = b["machine"];
    json["figures_in_both"] = figures.size();
    json["times_b_over_a"] = median_or_null(times);
    json["ratios_b_over_a"] = median_or_null(ratios);
    json["figures"] = std::move(figures);
    return json;
}

Result<void> write_trade_report(const OutputPlace& place, const ReportHeader& header,
                                const std::vector<Json>& documents) {
    Json data;
    data["documents"] = documents;
    return write_report(place, header, std::move(data), assets::trade_js);
}

CommandResult<void> run_comparison(const ComparisonOptions& options) {
    std::vector<Json> documents;
    for (const std::string& path : options.files) {
        TERRANE_TRY(Json document, read_trade_document(path));
        documents.push_back(std::move(document));
    }
    const Json compared = compare_documents(documents[0], documents[1]);
    if (compared["figures_in_both"] == 0) {
        return failure(fmt::format("'{}' and '{}' have no figure in common", options.files[0],
                                   options.files[1]));
    }
    Json summary = compared;
    summary.erase("figures");
    if (!options.out.empty()) {
        TERRANE_TRY(const auto folder, OutputFolder::open(options.out, {kReportName}, false));
        TERRANE_TRY(folder->clear());
        TERRANE_TRY(write_trade_report(OutputPlace(folder, kReportName),
                                       {.title = "Trade-offs of two runs",
                                        .command_line = own_command_line(),
                                        .film = "",
                                        .summary = summary},
                                       documents));
    }
    if (options.json) {
        print_summary(compared, true);
        return {};
    }
    for (const Json& figure : compared["figures"]) {
        if (!figure.contains("ratio_b_over_a") || !figure["b_over_a"].is_number()) continue;
        fmt::print("{:<18} {:<14} {:<22} {:<12} {:>10.4g} {:>10.4g} {:<2}  b/a {:>6.3g}\n",
                   figure["dial"].get<std::string>(), figure["terrain"].get<std::string>(),
                   figure["label"].get<std::string>(), figure["column"].get<std::string>(),
                   figure["a"].get<double>(), figure["b"].get<double>(),
                   figure["unit"].get<std::string>(), figure["b_over_a"].get<double>());
    }
    print_summary(summary, false);
    return {};
}

}  // namespace terrane::tools
