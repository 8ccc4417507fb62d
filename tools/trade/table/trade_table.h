// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace terrane::tools {

/// Unit of a measured column. Times also get a ratio to the reference loop.
enum class TradeUnit {
    none,
    px,
    m,
    ns,
    ms,
    bytes,
    share,
    px_s,  ///< pixel seconds
};

/// `px`, `ns` and so on; "" for none.
const char* symbol_of(TradeUnit unit);
/// Seconds of one unit of time; 0 for other units.
double seconds_of(TradeUnit unit);

/// A named number that one trial measures.
struct TradeColumn {
    std::string key;  ///< "update_ms"
    std::string title;
    TradeUnit unit = TradeUnit::none;
};

/// One number of one row, from the repetitions of its trial.
struct TradeFigure {
    double median = 0.0;
    double low = 0.0, high = 0.0;  ///< smallest and largest repetition
    double ratio = 0.0;            ///< median of time over reference loop; 0 where it is no time
    std::size_t repetitions = 0;   ///< 0: not measured
};

/// Summarizes repetitions.
///
/// @param ratios [values] of a time to the reference loop of the same turn; empty where it is no time
TradeFigure summarize_figure(const std::vector<double>& values, const std::vector<double>& ratios);

/// One value of a dial with its figures.
struct TradeRow {
    std::string label;                 ///< "100000", "sap"
    double value = 0.0;                ///< on the dial's axis; the row's index for named values
    std::string command;               ///< that measures this row
    std::vector<std::string> presets;  ///< those that have this value
    std::vector<TradeFigure> figures;  ///< [TradeTable::columns]
    bool on_front = false;             ///< no other row has both less cost and less loss
};

/// What one dial costs and gives over one terrain, with everything else fixed.
struct TradeTable {
    std::string key;      ///< of the dial: "budget"
    std::string title;    ///< "Triangle budget"
    std::string axis;     ///< with its unit: "triangles"; "" where the values are names
    std::string text;     ///< what was held fixed
    std::string terrain;  ///< "" where the dial needs no terrain
    std::vector<TradeColumn> columns;
    std::string cost, loss;  ///< keys of the columns of the front; both are better where smaller
    std::vector<TradeRow> rows;
    std::vector<std::string> findings;  ///< sentences with measured numbers
};

/// Marks the rows that no other row beats: a row is beaten where another one has neither more cost nor more loss, and
/// less of one. Rows without either figure are not on the front.
void mark_front(TradeTable& table);

/// The index of a column; the number of columns where there is none of that key.
std::size_t column_index(const TradeTable& table, const std::string& key);

/// In the form of trade.json.
nlohmann::ordered_json to_json(const TradeTable& table);

}  // namespace terrane::tools
