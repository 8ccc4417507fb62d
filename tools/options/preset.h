// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace terrane::tools {

/// The value that a preset gives to a flag.
struct PresetFlag {
    std::string_view flag;   ///< "--budget"
    std::string_view value;  ///< as on the command line
};

/// Values of several flags under one name.
struct Preset {
    std::string_view name;
    std::array<PresetFlag, 5> flags;
};

/// fast, balanced and accurate: points of the fronts that `terrane trade` measures, see docs/measurements.md.
const std::array<Preset, 3>& presets();

/// The value of a preset's flag as a number; absent for a flag that presets do not set.
std::optional<double> preset_value(const Preset& preset, std::string_view flag);

/// Names of the presets that give a value to a flag.
std::vector<std::string> presets_with(std::string_view flag, double value);

/// Adds --preset. It sets those flags of a preset that the command has and that are not on the command line, whatever
/// the order of the words; is_given() stays false for them. To be called after all other flags of the command.
void add_preset_option(CLI::App& command);

}  // namespace terrane::tools
