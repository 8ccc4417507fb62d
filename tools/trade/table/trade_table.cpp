// SPDX-License-Identifier: MIT
#include "trade/table/trade_table.h"

#include <algorithm>

namespace terrane::tools {
namespace {

double median_value(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

nlohmann::ordered_json figure_json(const TradeFigure& figure, TradeUnit unit) {
    nlohmann::ordered_json json;
    json["median"] = figure.median;
    json["low"] = figure.low;
    json["high"] = figure.high;
    json["repetitions"] = figure.repetitions;
    if (seconds_of(unit) > 0.0) json["ratio"] = figure.ratio;
    return json;
}

}  // namespace

const char* symbol_of(TradeUnit unit) {
    switch (unit) {
        case TradeUnit::none:
            return "";
        case TradeUnit::px:
            return "px";
        case TradeUnit::m:
            return "m";
        case TradeUnit::ns:
            return "ns";
        case TradeUnit::ms:
            return "ms";
        case TradeUnit::bytes:
            return "bytes";
        case TradeUnit::share:
            return "share";
        case TradeUnit::px_s:
            return "px s";
    }
    return "";
}

double seconds_of(TradeUnit unit) {
    if (unit == TradeUnit::ns) return 1e-9;
    return unit == TradeUnit::ms ? 1e-3 : 0.0;
}

TradeFigure summarize_figure(const std::vector<double>& values, const std::vector<double>& ratios) {
    TradeFigure figure;
    if (values.empty()) return figure;
    figure.median = median_value(values);
    figure.low = *std::min_element(values.begin(), values.end());
    figure.high = *std::max_element(values.begin(), values.end());
    figure.ratio = median_value(ratios);
    figure.repetitions = values.size();
    return figure;
}

std::size_t column_index(const TradeTable& table, const std::string& key) {
    const auto found =
        std::find_if(table.columns.begin(), table.columns.end(),
                     [&key](const TradeColumn& column) { return column.key == key; });
    return static_cast<std::size_t>(found - table.columns.begin());
}

void mark_front(TradeTable& table) {
    const std::size_t cost = column_index(table, table.cost);
    const std::size_t loss = column_index(table, table.loss);
    for (TradeRow& row : table.rows) row.on_front = false;
    if (cost == table.columns.size() || loss == table.columns.size()) return;
    const auto is_measured = [&](const TradeRow& row) {
        return row.figures[cost].repetitions > 0 && row.figures[loss].repetitions > 0;
    };
    const auto beats = [&](const TradeRow& a, const TradeRow& b) {
        const double a_cost = a.figures[cost].median, b_cost = b.figures[cost].median;
        const double a_loss = a.figures[loss].median, b_loss = b.figures[loss].median;
        return a_cost <= b_cost && a_loss <= b_loss && (a_cost < b_cost || a_loss < b_loss);
    };
    for (TradeRow& row : table.rows) {
        row.on_front =
            is_measured(row) &&
            std::none_of(table.rows.begin(), table.rows.end(), [&](const TradeRow& each) {
                return is_measured(each) && beats(each, row);
            });
    }
}

nlohmann::ordered_json to_json(const TradeTable& table) {
    nlohmann::ordered_json json;
    json["key"] = table.key;
    json["title"] = table.title;
    json["axis"] = table.axis;
    json["text"] = table.text;
    json["terrain"] = table.terrain;
    json["cost"] = table.cost;
    json["loss"] = table.loss;
    json["columns"] = nlohmann::ordered_json::array();
    for (const TradeColumn& column : table.columns) {
        json["columns"].push_back(
            {{"key", column.key}, {"title", column.title}, {"unit", symbol_of(column.unit)}});
    }
    json["rows"] = nlohmann::ordered_json::array();
    for (const TradeRow& row : table.rows) {
        nlohmann::ordered_json line;
        line["label"] = row.label;
        line["value"] = row.value;
        line["on_front"] = row.on_front;
        line["presets"] = row.presets;
        line["command"] = row.command;
        line["figures"] = nlohmann::ordered_json::object();
        for (std::size_t i = 0; i < table.columns.size(); ++i) {
            if (row.figures[i].repetitions == 0) continue;
            line["figures"][table.columns[i].key] =
                figure_json(row.figures[i], table.columns[i].unit);
        }
        json["rows"].push_back(std::move(line));
    }
    json["findings"] = table.findings;
    return json;
}

}  // namespace terrane::tools
