// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace terrane::tools {

/// Size of a picture; 1280x720 on the command line.
struct ImageSize {
    int width_px = 1280;
    int height_px = 720;
};

/// Parses the whole text as one finite number or the quotient of two (1/60); absent for anything else.
std::optional<double> parse_number(std::string_view text);
/// Parses "X,Y,Z", three finite numbers; absent for anything else.
std::optional<WorldPos> parse_point(std::string_view text);
/// Parses "X,Y", two finite numbers; absent for anything else.
std::optional<WorldVec2> parse_place(std::string_view text);
/// Parses "WxH", with both numbers 1 to 16384; absent for anything else.
std::optional<ImageSize> parse_size(std::string_view text);
/// Parses "A,B,C" into one or more items; absent if an item is empty.
std::optional<std::vector<std::string>> parse_list(std::string_view text);

/// The value of an optional flag; absent for NaN, the value of a flag that was not given.
std::optional<double> given(double value);

/// Each function adds a flag and checks its value. For a value out of range, NaN or infinity, parsing throws a
/// CLI::ParseError that names the flag, the range and the value; main() then exits with code 2.
CLI::Option* add_positive(CLI::App& app, const std::string& flag, double& value,
                          const std::string& help);
CLI::Option* add_not_negative(CLI::App& app, const std::string& flag, double& value,
                              const std::string& help);
CLI::Option* add_finite(CLI::App& app, const std::string& flag, double& value,
                        const std::string& help);
CLI::Option* add_in_range(CLI::App& app, const std::string& flag, double& value, double low,
                          double high, const std::string& help);
/// The same for a flag with several values, separated by commas.
CLI::Option* add_positive_list(CLI::App& app, const std::string& flag, std::vector<double>& values,
                               const std::string& help);
CLI::Option* add_in_range_list(CLI::App& app, const std::string& flag, std::vector<double>& values,
                               double low, double high, const std::string& help);
/// Adds a flag with a whole number from `low` to `high`.
CLI::Option* add_count(CLI::App& app, const std::string& flag, std::size_t& value, std::size_t low,
                       const std::string& help, std::size_t high = std::size_t{1} << 53);
/// Adds a flag whose value is one of several names. The error for another word suggests the nearest name.
///
/// @param usual  index of the default
/// @param choose called with the index of the chosen name
CLI::Option* add_choice(CLI::App& app, const std::string& flag, std::vector<std::string> names,
                        std::size_t usual, std::function<void(std::size_t)> choose,
                        const std::string& help);
/// Adds a flag whose value is a list of such names, separated by commas.
CLI::Option* add_choice_list(CLI::App& app, const std::string& flag, std::vector<std::string> names,
                             std::function<void(const std::vector<std::size_t>&)> choose,
                             const std::string& help);
/// The items of "A,B,C". Throws a CLI::ParseError, as the flags do.
std::vector<std::string> read_list(const std::string& flag, const std::string& text);
/// The index of the name `text`. Throws a CLI::ParseError, as the flags do.
std::size_t read_choice(const std::string& flag, const std::vector<std::string>& names,
                        const std::string& text);
CLI::Option* add_point(CLI::App& app, const std::string& flag, std::optional<WorldPos>& value,
                       const std::string& help);
CLI::Option* add_place(CLI::App& app, const std::string& flag, std::optional<WorldVec2>& value,
                       const std::string& help);
CLI::Option* add_size(CLI::App& app, const std::string& flag, ImageSize& value,
                      const std::string& help);

/// The value that a preset gives to a flag.
struct PresetFlag {
    std::string_view flag;   ///< "--budget"
    std::string_view value;  ///< text, as on the command line
};

/// Values of several flags under one name.
struct Preset {
    std::string_view name;
    std::array<PresetFlag, 5> flags;
};

/// fast, balanced and accurate: points on the Pareto fronts measured by `terrane trade`, see docs/measurements.md.
const std::array<Preset, 3>& presets();

/// The value that a preset gives to a flag, as a number; absent for a flag that presets do not set.
std::optional<double> preset_value(const Preset& preset, std::string_view flag);

/// Names of the presets that set a flag to `value`.
std::vector<std::string> presets_with(std::string_view flag, double value);

/// Adds --preset. It sets the preset's flags that the command has, except those on the command line, in any order of
/// the arguments. is_given() is false for the flags that it sets. Call after adding all other flags of the command.
void add_preset_option(CLI::App& command);

}  // namespace terrane::tools
