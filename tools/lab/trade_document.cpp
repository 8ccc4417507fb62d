// SPDX-License-Identifier: MIT
#include "lab/trade_document.h"

#include "assets.h"
#include "frames/flight_log.h"
#include "program/json_values.h"
#include "program/options.h"
#include "program/output_file.h"
#include "program/summary.h"

#include <terrane/base/version.h>

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTradeFormat = "terrane trade";
constexpr int kFormatVersion = 1;

/// Types of the values that compare_documents() and the report read. All items of a list have the form of the only item
/// here; a key with ? may be absent; * stands for any key.
constexpr const char* kDocumentForm = R"({
    "machine": {},
    "reference_loop_ms": {"median": 0, "low": 0, "high": 0, "repetitions": 0},
    "tables": [{
        "key": "", "title": "", "axis": "", "text": "", "terrain": "", "cost": "", "loss": "",
        "columns": [{"key": "", "title": "", "unit": ""}],
        "rows": [{
            "label": "", "command": "", "presets": [""],
            "figures": {"*": {"median": 0, "low": 0, "high": 0, "repetitions": 0, "ratio?": 0}}
        }],
        "findings": [""]
    }]
})";

// The first deviation of a value from a form; "" if there is none.
std::string fault_of(const Json& value, const Json& form, const std::string& name) {
    const std::string type = form.type_name();
    if (value.type_name() != type) return fmt::format("{} is no {}", name, type);
    std::string fault;
    if (form.is_array() || (form.is_object() && form.contains("*"))) {
        for (const Json& item : value) {
            if (fault.empty()) fault = fault_of(item, form.front(), "an item of " + name);
        }
    } else if (form.is_object()) {
        for (const auto& [key, inner] : form.items()) {
            const bool is_optional = key.ends_with('?');
            const std::string own = key.substr(0, key.size() - (is_optional ? 1 : 0));
            if (!fault.empty() || (is_optional && !value.contains(own))) continue;
            fault = value.contains(own)
                        ? fault_of(value[own], inner, own)
                        : fmt::format("{} has no {} '{}'", name, inner.type_name(), own);
        }
    }
    return fault;
}

std::string fault_of_document(const Json& document) {
    if (!document.is_object() || document.value("format", Json()) != kTradeFormat) {
        return fmt::format("it has no \"format\": \"{}\"", kTradeFormat);
    }
    if (document.value("format_version", Json()) != kFormatVersion) {
        return fmt::format("its format_version is not {}", kFormatVersion);
    }
    return fault_of(document, Json::parse(kDocumentForm), "it");
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

Json start_trade_document(bool is_quick) {
    const Machine machine = this_machine();
    Json known = Json::array();
    for (const Preset& preset : presets()) {
        Json flags;
        for (const PresetFlag& each : preset.flags) flags[std::string(each.flag)] = each.value;
        known.push_back({{"name", preset.name}, {"flags", flags}});
    }
    return {{"format", kTradeFormat},
            {"format_version", kFormatVersion},
            {"command", own_command_line()},
            {"quick", is_quick},
            {"seconds", 0.0},
            {"machine",
             {{"processor", machine.processor},
              {"threads", machine.threads},
              {"compiler", machine.compiler},
              {"build", machine.build},
              {"version", library_version()}}},
            {"reference_loop_ms", nullptr},
            {"presets", known},
            {"tables", Json::array()},
            {"idle_dials", Json::array()}};
}

CommandResult<Json> read_trade_document(const std::string& path) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file.is_open() || file.bad()) {
        return failure(fmt::format("cannot read '{}': {}", path, std::strerror(errno)));
    }
    Parsed<Json> document = parse_json(text);
    const std::string fault = document ? fault_of_document(*document)
                                       : fmt::format("it is no JSON: {}", document.error());
    if (!fault.empty()) {
        return failure(fmt::format("'{}' is no trade.json of terrane trade: {}", path, fault));
    }
    return *std::move(document);
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

CommandResult<void> run_comparison(const std::vector<std::string>& files, const std::string& out,
                                   bool as_json) {
    std::vector<Json> documents;
    for (const std::string& path : files) {
        TERRANE_TRY(Json document, read_trade_document(path));
        documents.push_back(std::move(document));
    }
    const Json compared = compare_documents(documents[0], documents[1]);
    if (compared["figures_in_both"] == 0) {
        return failure(fmt::format("'{}' and '{}' have no figure in common", files[0], files[1]));
    }
    Json summary = compared;
    summary.erase("figures");
    TERRANE_TRY(const auto folder, OutputFolder::open(out, {kReportName}));
    if (folder != nullptr) {
        TERRANE_TRY(folder->clear());
        TERRANE_TRY(write_trade_report(OutputPlace(folder, kReportName),
                                       {.title = "Trade-offs of two runs", .summary = summary},
                                       documents));
    }
    if (as_json) {
        print_summary(compared, true);
        return {};
    }
    for (const Json& figure : compared["figures"]) {
        if (!figure.contains("ratio_b_over_a") || !figure["b_over_a"].is_number()) continue;
        print_text(
            fmt::format("{:<18} {:<14} {:<22} {:<12} {:>10.4g} {:>10.4g} {:<2}  b/a {:>6.3g}\n",
                        figure["dial"].get<std::string>(), figure["terrain"].get<std::string>(),
                        figure["label"].get<std::string>(), figure["column"].get<std::string>(),
                        figure["a"].get<double>(), figure["b"].get<double>(),
                        figure["unit"].get<std::string>(), figure["b_over_a"].get<double>()));
    }
    print_summary(summary, false);
    return {};
}

}  // namespace terrane::tools
