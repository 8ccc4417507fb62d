// SPDX-License-Identifier: MIT
#include "options/preset.h"

#include "options/option_values.h"

#include <CLI/CLI.hpp>

#include <algorithm>

namespace terrane::tools {

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
                    option->default_str(std::string(each.value));  // for messages about memory
                }
            },
            "fast, balanced or accurate: values of those of --budget, --max-error-px, "
            "--memory-mb, --dt and --substep that are flags of this command and not given; see "
            "docs/measurements.md")
        ->type_name("NAME");
}

}  // namespace terrane::tools
