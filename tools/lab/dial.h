// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"
#include "scene/terrain_options.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Processor time of the calling thread, seconds: other programs on the machine do not lengthen it. For what runs on
/// this thread alone.
double thread_seconds();

/// Runs a fixed computation on this thread and returns its processor time, seconds; about a millisecond on a processor
/// of 2020. Half of it is a chain of integer hashes over a table of 256 KiB, half a chain of double-precision products
/// and sums: no library function and no vector width is part of it. So times over that of the loop in the same run can
/// be compared between machines, and between versions of the library.
double time_reference_loop();

/// Processor time of one call, nanoseconds: of the calls 0 to count - 1, in as many rounds as take two milliseconds
/// together.
///
/// @param call takes an index and returns a number that depends on its result, so that the call is not removed
template <class Call>
double time_call_ns(std::size_t count, const Call& call) {
    constexpr double kLeast = 2e-3;  // seconds
    if (count == 0) return 0.0;
    double sum = 0.0;
    std::size_t calls = 0;
    const double start = thread_seconds();
    double taken = 0.0;
    while (taken < kLeast) {
        for (std::size_t i = 0; i < count; ++i) sum += static_cast<double>(call(i));
        calls += count;
        taken = thread_seconds() - start;
    }
    [[maybe_unused]] static volatile double sink;
    sink = sum;
    return 1e9 * taken / static_cast<double>(calls);
}

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

/// Where and how thoroughly a dial is measured.
struct TradePlace {
    const Terrain* terrain = nullptr;  ///< null for dials that need none
    std::string flags;                 ///< that choose the terrain: "--seed 7"
    bool is_quick = false;             ///< shorter flights, fewer bodies and questions
};

/// Values of the columns of one repetition; NaN: not measured.
using TradeSample = std::vector<double>;

/// A value of a dial, ready to be measured. What it needs is loaded already.
struct TradeTrial {
    std::string label;
    double value = 0.0;
    std::string command;  ///< "": the command of the dial
    std::function<CommandResult<TradeSample>()> measure;
};

/// A setting that trades one cost for another: its values, and what is measured at each of them.
struct Dial {
    std::string key, title, axis, text;  ///< as in TradeTable
    bool needs_terrain = true;
    std::string preset_flag;  ///< the flag of presets that has the dial's values; "": none
    std::vector<TradeColumn> columns;
    std::string cost, loss;
    /// Why no value can have an effect at a place; absent where one can. May be empty.
    std::function<std::optional<std::string>(const TradePlace&)> idle_reason;
    std::function<CommandResult<std::vector<TradeTrial>>(const TradePlace&)> prepare;
    /// Sentences about a measured table; may be empty.
    std::function<std::vector<std::string>(const TradeTable&)> find;
};

/// How long a dial is measured.
struct TradePatience {
    /// Further repetitions begin within these seconds of the first one's end; <= 0: the first one alone.
    double seconds = 3.0;
    std::size_t most_repetitions = 9;  ///< of each value
};

/// Measures a dial. Its values take turns, and so does the reference loop, so that a temporary slowdown of the machine
/// affects all of them alike. The first repetition warms caches up, and is left out where there are others.
///
/// Fails: as the dial's trials; exit_failed where is_interrupted()
CommandResult<TradeTable> measure_dial(const Dial& dial, const TradePlace& place,
                                       const TradePatience& patience);

/// Budget, target, morph ratio: pixels against triangles and time; presets, which set these and others.
std::vector<Dial> pixel_dials();
/// Contact spacing, contact tolerance: metres against time.
std::vector<Dial> contact_dials();
/// Length of a step, length of a substep: penetration and drift against time.
std::vector<Dial> step_dials();
/// Memory, storage, horizon, contact share: late frames and excess error against bytes.
std::vector<Dial> paging_dials();
/// Tests, lifts, pseudodistances and distances, of shapes and the ground and of two shapes: order against time.
std::vector<Dial> measure_dials();
/// Squares or roots, float or double: numbers against time.
std::vector<Dial> number_dials();
/// Extremal points by scan or climb; collision meshes from full to one hull.
std::vector<Dial> hull_dials();
/// Culling tests, triangles of object meshes.
std::vector<Dial> object_dials();
/// Broadphases, threads.
std::vector<Dial> crowd_dials();

/// All of these, in this order.
std::vector<Dial> all_dials();

/// The keys of all dials: names for --dial.
std::vector<std::string> dial_names();

}  // namespace terrane::tools
