// SPDX-License-Identifier: MIT
#include "output/summary.h"

#include "output/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace terrane::tools {
std::string to_line(const nlohmann::ordered_json& value) {
    return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string format_summary(const nlohmann::ordered_json& summary, bool as_json) {
    if (as_json) return to_line(summary) + "\n";
    std::size_t width = 0;
    for (const auto& [key, value] : summary.items()) width = std::max(width, key.size());
    std::string text;
    for (const auto& [key, value] : summary.items()) {
        text += fmt::format("{:<{}}  {}", key, width, figure_text(key, value));
        const std::string note = figure_note(key, summary);
        text += note.empty() ? "\n" : "  (" + note + ")\n";
    }
    return text;
}

void print_summary(const nlohmann::ordered_json& summary, bool as_json) {
    const std::string text = format_summary(summary, as_json);
    std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace terrane::tools
