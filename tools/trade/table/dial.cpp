// SPDX-License-Identifier: MIT
#include "trade/table/dial.h"

#include "options/preset.h"
#include "output/interrupt.h"
#include "trade/table/reference_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace terrane::tools {
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

// Says so where a dial has no effect on what it is meant to change: a front of such a table means nothing.
void note_constant_loss(TradeTable& table) {
    const std::size_t loss = column_index(table, table.loss);
    if (loss == table.columns.size() || table.rows.size() < 2) return;
    const TradeFigure& first = table.rows.front().figures[loss];
    const bool is_constant =
        std::all_of(table.rows.begin(), table.rows.end(), [&](const TradeRow& row) {
            return row.figures[loss].repetitions > 0 && row.figures[loss].median == first.median;
        });
    if (!is_constant) return;
    const std::string unit = symbol_of(table.columns[loss].unit);
    table.findings.push_back(fmt::format("No value of this dial changes the {} here: {:.3g}{}{}.",
                                         table.columns[loss].title, first.median,
                                         unit.empty() ? "" : " ", unit));
}

}  // namespace

CommandResult<TradeTable> measure_dial(const Dial& dial, const TradePlace& place,
                                       const TradePatience& patience) {
    using Clock = std::chrono::steady_clock;
    const CommandResult<std::vector<TradeTrial>> trials = dial.prepare(place);
    if (!trials) return pass_on(trials.error());
    const TurnLog empty{.values = std::vector<std::vector<double>>(dial.columns.size()),
                        .ratios = std::vector<std::vector<double>>(dial.columns.size())};
    std::vector<TurnLog> logs(trials->size(), empty);
    const auto take_turn = [&]() -> CommandResult<void> {
        for (std::size_t i = 0; i < trials->size(); ++i) {
            if (is_interrupted()) return failure("interrupted before the tables were whole");
            const double reference_s = time_reference_loop();
            const CommandResult<TradeSample> sample = (*trials)[i].measure();
            if (!sample) return pass_on(sample.error());
            add_turn(logs[i], *sample, dial.columns, reference_s);
        }
        return {};
    };
    CommandResult<void> turn = take_turn();
    if (turn && patience.seconds > 0.0) {
        logs.assign(trials->size(), empty);
        const Clock::time_point end =
            Clock::now() + std::chrono::duration_cast<Clock::duration>(
                               std::chrono::duration<double>(patience.seconds));
        std::size_t repetitions = 0;
        do {
            turn = take_turn();
        } while (turn && ++repetitions < patience.most_repetitions && Clock::now() < end);
    }
    if (!turn) return pass_on(turn.error());
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

}  // namespace terrane::tools
