// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "source/terrain_options.h"
#include "trade/table/trade_table.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

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

}  // namespace terrane::tools
