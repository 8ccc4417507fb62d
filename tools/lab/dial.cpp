// SPDX-License-Identifier: MIT
#include "lab/dial.h"

#include "program/options.h"
#include "program/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>

namespace terrane::tools {

double time_reference_loop() {
    constexpr std::size_t kEntries = std::size_t{1} << 15;  // of 8 bytes: fits in the L2 cache
    constexpr int kSteps = 60'000;
    static const std::vector<std::uint64_t> table = [] {
        std::vector<std::uint64_t> made(kEntries);
        std::uint64_t state = 1;
        for (std::uint64_t& entry : made) {
            state = state * 6364136223846793005U + 1442695040888963407U;
            entry = state;
        }
        return made;
    }();
    const Stopwatch watch(Clock::thread);
    std::uint64_t hash = 1;
    double sum = 1.0;
    for (int i = 0; i < kSteps; ++i) {
        hash = (hash ^ table[hash >> 49U]) * 0x9E3779B97F4A7C15U;
        sum = sum * 0.999 + static_cast<double>(hash >> 12U) * 0x1p-52;
    }
    const double taken = 1e-3 * watch.ms();
    // uses the results, which are never negative, so that the loop is not optimised away
    return sum < 0.0 ? 0.0 : taken;
}

namespace {

// Seconds of one unit of time; 0 for other units.
double seconds_of(const std::string& unit) {
    if (unit == "ns") return 1e-9;
    return unit == "ms" ? 1e-3 : 0.0;
}

}  // namespace

TradeFigure summarize_figure(const std::vector<double>& values, const std::vector<double>& ratios) {
    TradeFigure figure;
    if (values.empty()) return figure;
    figure.median = median(values);
    figure.low = *std::min_element(values.begin(), values.end());
    figure.high = *std::max_element(values.begin(), values.end());
    figure.ratio = median(ratios);
    figure.repetitions = values.size();
    return figure;
}

nlohmann::ordered_json to_json(const TradeFigure& figure, const std::string& unit) {
    nlohmann::ordered_json json{{"median", figure.median},
                                {"low", figure.low},
                                {"high", figure.high},
                                {"repetitions", figure.repetitions}};
    if (seconds_of(unit) > 0.0) json["ratio"] = figure.ratio;
    return json;
}

std::size_t column_index(const Dial& dial, const std::string& key) {
    const auto found = std::ranges::find(dial.columns, key, &TradeColumn::key);
    return static_cast<std::size_t>(found - dial.columns.begin());
}

void mark_front(TradeTable& table) {
    const std::size_t cost = column_index(table.dial, table.dial.cost);
    const std::size_t loss = column_index(table.dial, table.dial.loss);
    const std::size_t count = table.dial.columns.size();
    const auto is_measured = [&](const TradeRow& row) {
        return cost < count && loss < count && row.figures[cost].repetitions > 0 &&
               row.figures[loss].repetitions > 0;
    };
    const auto beats = [&](const TradeRow& a, const TradeRow& b) {
        const double a_cost = a.figures[cost].median, b_cost = b.figures[cost].median;
        const double a_loss = a.figures[loss].median, b_loss = b.figures[loss].median;
        return a_cost <= b_cost && a_loss <= b_loss && (a_cost < b_cost || a_loss < b_loss);
    };
    for (TradeRow& row : table.rows) {
        row.on_front =
            is_measured(row) && std::ranges::none_of(table.rows, [&](const TradeRow& each) {
                return is_measured(each) && beats(each, row);
            });
    }
}

nlohmann::ordered_json to_json(const TradeTable& table) {
    using Json = nlohmann::ordered_json;
    const Dial& dial = table.dial;
    Json columns = Json::array(), rows = Json::array();
    for (const TradeColumn& column : dial.columns) {
        columns.push_back({{"key", column.key}, {"title", column.title}, {"unit", column.unit}});
    }
    for (const TradeRow& row : table.rows) {
        Json figures = Json::object();
        for (std::size_t i = 0; i < dial.columns.size(); ++i) {
            if (row.figures[i].repetitions == 0) continue;
            figures[dial.columns[i].key] = to_json(row.figures[i], dial.columns[i].unit);
        }
        rows.push_back({{"label", row.label},
                        {"value", row.value},
                        {"on_front", row.on_front},
                        {"presets", row.presets},
                        {"command", row.command},
                        {"figures", figures}});
    }
    return {{"key", dial.key},           {"title", dial.title},      {"axis", dial.axis},
            {"text", dial.text},         {"terrain", table.terrain}, {"cost", dial.cost},
            {"loss", dial.loss},         {"columns", columns},       {"rows", rows},
            {"findings", table.findings}};
}

namespace {

/// Repetitions of one trial.
struct TurnLog {
    std::vector<std::vector<double>> values;  ///< [columns][repetitions]
    std::vector<std::vector<double>> ratios;  ///< the same, as ratios to the reference loop
};

void add_turn(TurnLog& log, const TradeSample& sample, const std::vector<TradeColumn>& columns,
              double reference_s) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
        if (!std::isfinite(sample[i])) continue;
        log.values[i].push_back(sample[i]);
        const double unit_s = seconds_of(columns[i].unit);
        if (unit_s > 0.0) log.ratios[i].push_back(sample[i] * unit_s / reference_s);
    }
}

std::string command_of(const Dial& dial, const TradePlace& place) {
    std::string command = "terrane trade --dial " + dial.key;
    if (dial.needs_terrain) command += " " + place.flags;
    return command + (place.is_quick ? " --quick" : "");
}

TradeRow row_of(const Dial& dial, const TradePlace& place, const TradeTrial& trial,
                const TurnLog& log, std::size_t index) {
    TradeRow row;
    row.label = trial.label;
    row.value = trial.value.value_or(static_cast<double>(index));
    row.command = trial.command.empty() ? command_of(dial, place) : trial.command;
    row.presets = presets_with(dial.preset_flag, row.value);
    for (std::size_t i = 0; i < dial.columns.size(); ++i) {
        row.figures.push_back(summarize_figure(log.values[i], log.ratios[i]));
    }
    return row;
}

// Adds a finding if a dial has no effect on its loss, because the front of such a table is meaningless.
void note_constant_loss(TradeTable& table) {
    const std::size_t loss = column_index(table.dial, table.dial.loss);
    if (loss == table.dial.columns.size() || table.rows.size() < 2) return;
    const double first = table.rows.front().figures[loss].median;
    const bool is_constant = std::ranges::all_of(table.rows, [&](const TradeRow& row) {
        return row.figures[loss].repetitions > 0 && row.figures[loss].median == first;
    });
    if (!is_constant) return;
    const TradeColumn& column = table.dial.columns[loss];
    table.findings.push_back(fmt::format("No value of this dial changes the {} here: {:.3g}{}{}.",
                                         column.title, first, column.unit.empty() ? "" : " ",
                                         column.unit));
}

}  // namespace

CommandResult<TradeTable> measure_dial(const Dial& dial, const TradePlace& place,
                                       const Patience& patience) {
    TERRANE_TRY(const std::vector<TradeTrial> trials, dial.prepare(place));
    const std::vector<std::vector<double>> empty(dial.columns.size());
    std::vector<TurnLog> logs(trials.size(), TurnLog{empty, empty});
    CommandResult<void> taken;
    take_turns(trials.size(), patience, [&](std::size_t i, std::size_t turn) {
        if (is_interrupted()) taken = failure("interrupted before the tables were whole");
        if (!taken) return false;
        const double reference_s = time_reference_loop();
        const CommandResult<TradeSample> sample = trials[i].measure();
        if (!sample) {
            taken = pass_on(sample.error());
            return false;
        }
        if (turn == 1) logs[i] = {empty, empty};
        add_turn(logs[i], *sample, dial.columns, reference_s);
        return true;
    });
    TERRANE_TRY(taken);
    TradeTable table{.dial = dial, .terrain = dial.needs_terrain ? place.terrain->name : ""};
    for (std::size_t i = 0; i < trials.size(); ++i) {
        table.rows.push_back(row_of(dial, place, trials[i], logs[i], i));
    }
    mark_front(table);
    if (dial.find) table.findings = dial.find(table);
    note_constant_loss(table);
    return table;
}

std::vector<Dial> all_dials() {
    std::vector<Dial> all;
    for (const auto& make :
         {pixel_dials, contact_dials, paging_dials, number_dials, mesh_dials, crowd_dials}) {
        std::vector<Dial> dials = make();
        all.insert(all.end(), std::make_move_iterator(dials.begin()),
                   std::make_move_iterator(dials.end()));
    }
    return all;
}

std::vector<std::string> dial_names() {
    std::vector<std::string> names;
    for (const Dial& dial : all_dials()) names.push_back(dial.key);
    return names;
}

}  // namespace terrane::tools
