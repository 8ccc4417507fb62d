// SPDX-License-Identifier: MIT
#include "program/options.h"

#include "program/command.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

constexpr int kMaxSide_px = 16384;

/// Parses the whole text with from_chars.
template <class T>
std::optional<T> parse_whole(std::string_view text) {
    T value{};
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || rest != end) return std::nullopt;
    return value;
}

// Parses "A,B,..", with `Count` finite numbers.
template <std::size_t Count>
std::optional<std::array<double, Count>> parse_numbers(std::string_view text) {
    std::array<double, Count> numbers{};
    for (std::size_t i = 0; i < Count; ++i) {
        const std::size_t comma = text.find(',');
        if ((comma == std::string_view::npos) != (i + 1 == Count)) return std::nullopt;
        const std::optional<double> value = parse_number(text.substr(0, comma));
        if (!value) return std::nullopt;
        numbers[i] = *value;
        if (i + 1 < Count) text.remove_prefix(comma + 1);
    }
    return numbers;
}

// The text, shortened for messages.
std::string shortened(const std::string& text) {
    constexpr std::size_t kLongest = 60;
    return text.size() <= kLongest ? text : text.substr(0, kLongest) + "...";
}

[[noreturn]] void refuse(const std::string& flag, const std::string& wanted,
                         const std::string& got) {
    throw CLI::ValidationError(flag, fmt::format("must be {}, got '{}'", wanted, shortened(got)));
}

// The range of a number, as text for messages and as a predicate.
struct Rule {
    std::string wanted;
    std::function<bool(double)> is_met;
};

Rule positive() {
    return {"a number above 0", [](double x) { return x > 0.0; }};
}

Rule in_range(double low, double high) {
    return {fmt::format("{:.6g} to {:.6g}", low, high),
            [low, high](double x) { return x >= low && x <= high; }};
}

std::optional<double> parse_number(const Rule& rule, const std::string& text) {
    const std::optional<double> number = tools::parse_number(text);
    return number && rule.is_met(*number) ? number : std::nullopt;
}

// Adds a flag with one value. `parse` turns its text into the value, or into nullopt if the text is not `wanted`.
template <class T, class Parse>
CLI::Option* add_parsed(CLI::App& app, const std::string& flag, T& value, const Parse& parse,
                        const std::string& wanted, const std::string& help) {
    T* const target = &value;
    return app.add_option_function<std::string>(
        flag,
        [target, flag, parse, wanted](const std::string& text) {
            const auto parsed = parse(text);
            if (!parsed) refuse(flag, wanted, text);
            *target = *parsed;
        },
        help);
}

CLI::Option* add_number(CLI::App& app, const std::string& flag, double& value, const Rule& rule,
                        const std::string& help) {
    const auto parse = [rule](const std::string& text) { return parse_number(rule, text); };
    return add_parsed(app, flag, value, parse, rule.wanted, help)
        ->default_str(std::isnan(value) ? "" : fmt::format("{}", value))
        ->type_name("X");
}

CLI::Option* add_numbers(CLI::App& app, const std::string& flag, std::vector<double>& values,
                         const Rule& rule, const std::string& help) {
    std::vector<double>* const target = &values;
    CLI::Option* option = app.add_option_function<std::string>(
        flag,
        [target, flag, rule](const std::string& text) {
            const std::optional<std::vector<std::string>> items = parse_list(text);
            if (!items) refuse(flag, "numbers separated by commas", text);
            target->clear();
            for (const std::string& item : *items) {
                const std::optional<double> number = parse_number(rule, item);
                if (!number) refuse(flag, rule.wanted, item);
                target->push_back(*number);
            }
        },
        help);
    return option->default_str(fmt::format("{}", fmt::join(values, ",")))->type_name("X,...");
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
    if (const std::size_t slash = text.find('/'); slash != std::string_view::npos) {
        const std::optional<double> over = parse_whole<double>(text.substr(0, slash));
        const std::optional<double> under = parse_whole<double>(text.substr(slash + 1));
        if (!over || !under || !std::isfinite(*over / *under)) return std::nullopt;
        return *over / *under;
    }
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    const std::optional<double> value = parse_whole<double>(text);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    return value;
}

std::optional<WorldPos> parse_point(std::string_view text) {
    const auto numbers = parse_numbers<3>(text);
    if (!numbers) return std::nullopt;
    return WorldPos((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

std::optional<WorldVec2> parse_place(std::string_view text) {
    const auto numbers = parse_numbers<2>(text);
    if (!numbers) return std::nullopt;
    return WorldVec2((*numbers)[0], (*numbers)[1]);
}

std::optional<ImageSize> parse_size(std::string_view text) {
    const std::size_t cross = text.find('x');
    if (cross == std::string_view::npos) return std::nullopt;
    const std::optional<int> width = parse_whole<int>(text.substr(0, cross));
    const std::optional<int> height = parse_whole<int>(text.substr(cross + 1));
    if (!width || !height || *width < 1 || *height < 1 || *width > kMaxSide_px ||
        *height > kMaxSide_px) {
        return std::nullopt;
    }
    return ImageSize{.width_px = *width, .height_px = *height};
}

std::optional<double> given(double value) {
    return std::isnan(value) ? std::nullopt : std::optional<double>(value);
}

std::optional<std::vector<std::string>> parse_list(std::string_view text) {
    std::vector<std::string> items;
    for (;;) {
        const std::size_t comma = text.find(',');
        items.emplace_back(text.substr(0, comma));
        if (items.back().empty()) return std::nullopt;
        if (comma == std::string_view::npos) return items;
        text.remove_prefix(comma + 1);
    }
}

CLI::Option* add_positive(CLI::App& app, const std::string& flag, double& value,
                          const std::string& help) {
    return add_number(app, flag, value, positive(), help);
}

CLI::Option* add_not_negative(CLI::App& app, const std::string& flag, double& value,
                              const std::string& help) {
    const Rule rule{"a number of at least 0", [](double x) { return x >= 0.0; }};
    return add_number(app, flag, value, rule, help);
}

CLI::Option* add_finite(CLI::App& app, const std::string& flag, double& value,
                        const std::string& help) {
    return add_number(app, flag, value, {"a finite number", [](double) { return true; }}, help);
}

CLI::Option* add_in_range(CLI::App& app, const std::string& flag, double& value, double low,
                          double high, const std::string& help) {
    return add_number(app, flag, value, in_range(low, high), help);
}

CLI::Option* add_positive_list(CLI::App& app, const std::string& flag, std::vector<double>& values,
                               const std::string& help) {
    return add_numbers(app, flag, values, positive(), help);
}

CLI::Option* add_in_range_list(CLI::App& app, const std::string& flag, std::vector<double>& values,
                               double low, double high, const std::string& help) {
    return add_numbers(app, flag, values, in_range(low, high), help);
}

CLI::Option* add_count(CLI::App& app, const std::string& flag, std::size_t& value, std::size_t low,
                       const std::string& help, std::size_t high) {
    const auto parse = [low, high](const std::string& text) {
        const std::optional<std::size_t> number = parse_whole<std::size_t>(text);
        return number && *number >= low && *number <= high ? number : std::nullopt;
    };
    return add_parsed(app, flag, value, parse, fmt::format("a whole number, {} to {}", low, high),
                      help)
        ->default_str(fmt::format("{}", value))
        ->type_name("N");
}

std::size_t read_choice(const std::string& flag, const std::vector<std::string>& names,
                        const std::string& text) {
    const auto found = std::find(names.begin(), names.end(), text);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    const std::span<const std::string> all_but_last(names.data(), names.size() - 1);
    throw CLI::ValidationError(
        flag, fmt::format("must be {} or {}, got '{}'{}", fmt::join(all_but_last, ", "),
                          names.back(), shortened(text), did_you_mean(text, names)));
}

CLI::Option* add_choice(CLI::App& app, const std::string& flag, std::vector<std::string> names,
                        std::size_t usual, std::function<void(std::size_t)> choose,
                        const std::string& help) {
    const std::string usual_name = names[usual];
    CLI::Option* option = app.add_option_function<std::string>(
        flag,
        [flag, names = std::move(names), choose = std::move(choose)](const std::string& text) {
            choose(read_choice(flag, names, text));
        },
        help);
    return option->default_str(usual_name)->type_name("NAME");
}

std::vector<std::string> read_list(const std::string& flag, const std::string& text) {
    std::optional<std::vector<std::string>> items = parse_list(text);
    if (!items) refuse(flag, "names separated by commas", text);
    return std::move(*items);
}

CLI::Option* add_choice_list(CLI::App& app, const std::string& flag, std::vector<std::string> names,
                             std::function<void(const std::vector<std::size_t>&)> choose,
                             const std::string& help) {
    CLI::Option* option = app.add_option_function<std::string>(
        flag,
        [flag, names = std::move(names), choose = std::move(choose)](const std::string& text) {
            std::vector<std::size_t> chosen;
            for (const std::string& item : read_list(flag, text)) {
                chosen.push_back(read_choice(flag, names, item));
            }
            choose(chosen);
        },
        help);
    return option->type_name("NAME,...");
}

CLI::Option* add_point(CLI::App& app, const std::string& flag, std::optional<WorldPos>& value,
                       const std::string& help) {
    return add_parsed(app, flag, value, parse_point, "three finite numbers X,Y,Z", help)
        ->type_name("X,Y,Z");
}

CLI::Option* add_place(CLI::App& app, const std::string& flag, std::optional<WorldVec2>& value,
                       const std::string& help) {
    return add_parsed(app, flag, value, parse_place, "two finite numbers X,Y", help)
        ->type_name("X,Y");
}

CLI::Option* add_size(CLI::App& app, const std::string& flag, ImageSize& value,
                      const std::string& help) {
    return add_parsed(app, flag, value, parse_size,
                      fmt::format("WxH with both 1 to {}", kMaxSide_px), help)
        ->default_str(fmt::format("{}x{}", value.width_px, value.height_px))
        ->type_name("WxH");
}

const std::array<Preset, 3>& presets() {
    static constexpr std::array<Preset, 3> kPresets{{
        {"fast",
         {{{"--budget", "30000"},
           {"--max-error-px", "4"},
           {"--memory-mb", "128"},
           {"--dt", "1/30"},
           {"--substep", "1/60"}}}},
        {"balanced",
         {{{"--budget", "100000"},
           {"--max-error-px", "2"},
           {"--memory-mb", "512"},
           {"--dt", "1/60"},
           {"--substep", "1/120"}}}},
        {"accurate",
         {{{"--budget", "1000000"},
           {"--max-error-px", "0.5"},
           {"--memory-mb", "2048"},
           {"--dt", "1/300"},
           {"--substep", "1/120"}}}},
    }};
    return kPresets;
}

std::optional<double> preset_value(const Preset& preset, std::string_view flag) {
    for (const PresetFlag& each : preset.flags) {
        if (each.flag == flag) return parse_number(each.value);
    }
    return std::nullopt;
}

std::vector<std::string> presets_with(std::string_view flag, double value) {
    std::vector<std::string> names;
    for (const Preset& preset : presets()) {
        if (preset_value(preset, flag) == value) names.emplace_back(preset.name);
    }
    return names;
}

void add_preset_option(CLI::App& command) {
    std::vector<std::string> names;
    for (const Preset& preset : presets()) names.emplace_back(preset.name);
    command
        .add_option_function<std::string>(
            "--preset",
            [&command, names](const std::string& text) {
                const Preset& preset = presets()[read_choice("--preset", names, text)];
                for (const PresetFlag& each : preset.flags) {
                    CLI::Option* const option = command.get_option_no_throw(std::string(each.flag));
                    if (option == nullptr || option->count() > 0) continue;
                    option->add_result(std::string(each.value));
                    option->run_callback();
                    option->clear();
                    option->default_str(std::string(each.value));  // shown in messages about memory
                }
            },
            "fast, balanced or accurate: values of those of --budget, --max-error-px, "
            "--memory-mb, --dt and --substep that are flags of this command and not given; see "
            "docs/measurements.md")
        ->type_name("NAME");
}

}  // namespace terrane::tools
