// SPDX-License-Identifier: MIT
#pragma once

#include "lab/measure.h"
#include "program/command.h"
#include "scene/terrain_options.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {

/// Runs a fixed computation on this thread and returns its processor time, seconds; about a millisecond on a processor
/// of 2020. Half of it is a chain of integer hashes over a table of 256 KiB, half a chain of double-precision products
/// and sums, without library functions or dependence on vector width. Times divided by the loop's time in the same run
/// can therefore be compared between machines, and between versions of the library.
double time_reference_loop();

/// A named quantity measured by a trial.
struct TradeColumn {
    std::string key;  ///< "update_ms"
    std::string title;
    std::string unit = {};  ///< "px", "ms", "ns"; "" for none. Only times have TradeFigure::ratio
};

/// One figure of a row, from the repetitions of its trial.
struct TradeFigure {
    double median = 0.0;
    double low = 0.0, high = 0.0;  ///< smallest and largest repetition
    double ratio = 0.0;  ///< median ratio of the time to the reference loop's; 0 for other figures
    std::size_t repetitions = 0;  ///< 0: not measured
};

/// Summarizes repetitions.
///
/// @param ratios [values] each time divided by the reference loop's just before it; empty if the figure is not a time
TradeFigure summarize_figure(const std::vector<double>& values, const std::vector<double>& ratios);

/// A figure in the form of trade.json.
///
/// @param unit of the figure's column
nlohmann::ordered_json to_json(const TradeFigure& figure, const std::string& unit);

/// Where a dial is measured, and how thoroughly.
struct TradePlace {
    const Terrain* terrain = nullptr;  ///< null for dials that need none
    std::string flags;                 ///< flags that select the terrain: "--seed 7"
    bool is_quick = false;             ///< shorter flights, fewer bodies and queries
};

/// Values of the columns of one repetition; NaN: not measured.
using TradeSample = std::vector<double>;

/// A value of a dial, ready to be measured, with all data loaded.
struct TradeTrial {
    std::string label;  ///< "100000", "sap"
    std::function<CommandResult<TradeSample>()> measure;
    std::optional<double> value = {};  ///< position on the dial's axis; absent for named values
    std::string command = {};          ///< command that measures this value; "": the dial's command
};

using TradeTrials = CommandResult<std::vector<TradeTrial>>;

/// The trials of some values, in their order; or the first error.
///
/// @param make_trial called with each value; returns a TradeTrial or a CommandResult of one
template <class Value, class MakeTrial>
TradeTrials make_trials(const std::vector<Value>& values, const MakeTrial& make_trial) {
    std::vector<TradeTrial> trials;
    for (const Value& value : values) {
        TERRANE_TRY(TradeTrial trial, CommandResult<TradeTrial>(make_trial(value)));
        trials.push_back(std::move(trial));
    }
    return trials;
}

/// The values of a dial that is one field of some settings.
template <class Settings>
struct FieldValues {
    std::vector<double> all, quick;  ///< the values in a full and in a quick run
    void (*set)(double value, Settings& settings);
};

/// The trials of the values of a field, with all other settings fixed.
///
/// @param make_trial called with each value and its settings; returns a TradeTrial or a CommandResult of one
template <class Settings, class MakeTrial>
TradeTrials make_trials(const FieldValues<Settings>& values, const Settings& fixed, bool is_quick,
                        const MakeTrial& make_trial) {
    return make_trials(is_quick ? values.quick : values.all, [&](double value) {
        Settings settings = fixed;
        values.set(value, settings);
        return make_trial(value, settings);
    });
}

struct TradeTable;

/// A setting that trades one cost for another: its values, and the quantities measured at each.
struct Dial {
    std::string key;        ///< "budget"
    std::string title;      ///< "Triangle budget"
    std::string axis = {};  ///< with its unit: "triangles"; "" if the values are names
    std::string text;       ///< what is held fixed
    bool needs_terrain = true;
    std::string preset_flag = {};  ///< the flag with which presets set the dial; "" if they do not
    std::vector<TradeColumn> columns = {};
    std::string cost = {}, loss = {};  ///< keys of the front's columns; smaller is better for both
    /// Returns why no value can have an effect at a place; absent if a value can have one. The function may be empty.
    std::function<std::optional<std::string>(const TradePlace&)> idle_reason = {};
    std::function<TradeTrials(const TradePlace&)> prepare = {};
    /// Returns sentences about a measured table. The function may be empty.
    std::function<std::vector<std::string>(const TradeTable&)> find = {};
};

/// One value of a dial with its figures.
struct TradeRow {
    std::string label;
    double value = 0.0;  ///< position on the dial's axis; the row's index for named values
    std::string command;
    std::vector<std::string> presets;  ///< presets with this value
    std::vector<TradeFigure> figures;  ///< [Dial::columns]
    bool on_front = false;             ///< whether no other row beats it, see mark_front()
};

/// Cost and loss of one dial over one terrain, with all other settings fixed.
struct TradeTable {
    Dial dial;
    std::string terrain;  ///< "" if the dial needs no terrain
    std::vector<TradeRow> rows = {};
    std::vector<std::string> findings = {};  ///< sentences with measured numbers
};

/// Marks the Pareto front: the rows that no other row dominates. A row dominates another one if its cost and loss are
/// not larger and at least one of them is smaller. Rows without a cost or without a loss are not on the front.
void mark_front(TradeTable& table);

/// The index of a column; the number of columns for an unknown key.
std::size_t column_index(const Dial& dial, const std::string& key);

/// A table in the form of trade.json.
nlohmann::ordered_json to_json(const TradeTable& table);

/// Measures a dial in rounds. Each round measures every value once, each right after a run of the reference loop. The
/// first round warms up caches, and is dropped if there are others.
///
/// Fails: as the dial's trials; exit_failed if is_interrupted()
CommandResult<TradeTable> measure_dial(const Dial& dial, const TradePlace& place,
                                       const Patience& patience);

/// Dials of budget, error target and morph ratio (pixels against triangles and time), and of the presets.
std::vector<Dial> pixel_dials();
/// Dials of contact spacing and tolerance (metres against time), and of step and substep (penetration, drift and time).
std::vector<Dial> contact_dials();
/// Dials of memory, storage, horizon and contact share: late frames and excess error against bytes.
std::vector<Dial> paging_dials();
/// Dials of measures of proximity, between a shape and the ground and between two shapes (order of the objects against
/// time), and of squares or roots and float or double (accuracy against time).
std::vector<Dial> number_dials();
/// Dials of the search for extreme vertices, collision meshes, culling tests, and triangles of object meshes.
std::vector<Dial> mesh_dials();
/// Dials of broadphases and threads.
std::vector<Dial> crowd_dials();

/// The dials of all these functions, in this order.
std::vector<Dial> all_dials();

/// The keys of all dials: names for --dial.
std::vector<std::string> dial_names();

}  // namespace terrane::tools
