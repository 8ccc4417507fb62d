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
    constexpr std::size_t kEntries = std::size_t{1}
                                     << 15;  // of 8 bytes: fits the second-level cache
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
    using Json = nlohmann::ordered_json;
    Json columns = Json::array(), rows = Json::array();
    for (const TradeColumn& column : table.columns) {
        columns.push_back({{"key", column.key}, {"title", column.title}, {"unit", column.unit}});
    }
    for (const TradeRow& row : table.rows) {
        Json figures = Json::object();
        for (std::size_t i = 0; i < table.columns.size(); ++i) {
            if (row.figures[i].repetitions == 0) continue;
            figures[table.columns[i].key] = to_json(row.figures[i], table.columns[i].unit);
        }
        rows.push_back({{"label", row.label},
                        {"value", row.value},
                        {"on_front", row.on_front},
                        {"presets", row.presets},
                        {"command", row.command},
                        {"figures", figures}});
    }
    return {{"key", table.key},          {"title", table.title},     {"axis", table.axis},
            {"text", table.text},        {"terrain", table.terrain}, {"cost", table.cost},
            {"loss", table.loss},        {"columns", columns},       {"rows", rows},
            {"findings", table.findings}};
}

namespace {

/// Repetitions of one trial.
struct TurnLog {
    std::vector<std::vector<double>> values;  ///< [columns][repetitions]
    std::vector<std::vector<double>> ratios;  ///< the same, of times
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

TradeRow row_of(const Dial& dial, const TradePlace& place, const TradeTrial& trial,
                const TurnLog& log) {
    TradeRow row;
    row.label = trial.label;
    row.value = trial.value;
    row.command = trial.command;
    if (row.command.empty()) {
        row.command = "terrane trade --dial " + dial.key;
        if (dial.needs_terrain) row.command += " " + place.flags;
        if (place.is_quick) row.command += " --quick";
    }
    row.presets = presets_with(dial.preset_flag, trial.value);
    for (std::size_t i = 0; i < dial.columns.size(); ++i) {
        row.figures.push_back(summarize_figure(log.values[i], log.ratios[i]));
    }
    return row;
}

// Adds a finding if a dial has no effect on its loss: the front of such a table is meaningless.
void note_constant_loss(TradeTable& table) {
    const std::size_t loss = column_index(table, table.loss);
    if (loss == table.columns.size() || table.rows.size() < 2) return;
    const TradeFigure& first = table.rows.front().figures[loss];
    const bool is_constant =
        std::all_of(table.rows.begin(), table.rows.end(), [&](const TradeRow& row) {
            return row.figures[loss].repetitions > 0 && row.figures[loss].median == first.median;
        });
    if (!is_constant) return;
    const std::string& unit = table.columns[loss].unit;
    table.findings.push_back(fmt::format("No value of this dial changes the {} here: {:.3g}{}{}.",
                                         table.columns[loss].title, first.median,
                                         unit.empty() ? "" : " ", unit));
}

}  // namespace

CommandResult<TradeTable> measure_dial(const Dial& dial, const TradePlace& place,
                                       const Patience& patience) {
    const TradeTrials trials = dial.prepare(place);
    if (!trials) return pass_on(trials.error());
    const TurnLog empty{.values = std::vector<std::vector<double>>(dial.columns.size()),
                        .ratios = std::vector<std::vector<double>>(dial.columns.size())};
    std::vector<TurnLog> logs(trials->size(), empty);
    CommandResult<void> taken;
    take_turns(trials->size(), patience, [&](std::size_t i, std::size_t turn) {
        if (is_interrupted()) taken = failure("interrupted before the tables were whole");
        if (!taken) return false;
        const double reference_s = time_reference_loop();
        const CommandResult<TradeSample> sample = (*trials)[i].measure();
        if (!sample) {
            taken = pass_on(sample.error());
            return false;
        }
        if (turn == 1) logs[i] = empty;
        add_turn(logs[i], *sample, dial.columns, reference_s);
        return true;
    });
    if (!taken) return pass_on(taken.error());
    TradeTable table{.key = dial.key,
                     .title = dial.title,
                     .axis = dial.axis,
                     .text = dial.text,
                     .terrain = dial.needs_terrain ? place.terrain->name : "",
                     .columns = dial.columns,
                     .cost = dial.cost,
                     .loss = dial.loss,
                     .rows = {},
                     .findings = {}};
    for (std::size_t i = 0; i < trials->size(); ++i) {
        table.rows.push_back(row_of(dial, place, (*trials)[i], logs[i]));
    }
    mark_front(table);
    if (dial.find) table.findings = dial.find(table);
    note_constant_loss(table);
    return table;
}

std::vector<Dial> all_dials() {
    std::vector<Dial> all;
    for (const auto& make : {pixel_dials, contact_dials, paging_dials, measure_dials, number_dials,
                             hull_dials, object_dials, crowd_dials}) {
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
