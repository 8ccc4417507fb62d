// SPDX-License-Identifier: MIT
#include "report/report.h"

#include "assets.h"
#include "output/figures.h"
#include "output/output_file.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr std::size_t kMostPoints = 2000;

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&':
                result += "&amp;";
                break;
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '"':
                result += "&quot;";
                break;
            default:
                result += c;
        }
    }
    return result;
}

// JSON escaped for a script element.
std::string script_safe(const nlohmann::ordered_json& value) {
    std::string text = value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) {
        text.replace(at, 1, "\\u003c");
    }
    return text;
}

// Replaces {{NAME}} in a template, in one pass, so that inserted text is not searched.
std::string filled(std::string_view text,
                   const std::vector<std::pair<std::string_view, std::string>>& values) {
    std::string result;
    while (true) {
        const std::size_t open = text.find("{{");
        const std::size_t close = text.find("}}", open);
        if (close == std::string_view::npos) return result += text;
        const std::string_view name = text.substr(open + 2, close - open - 2);
        result += text.substr(0, open);
        for (const auto& [key, value] : values) {
            if (key == name) result += value;
        }
        text.remove_prefix(close + 2);
    }
}

}  // namespace

std::string own_command_line() {
    constexpr std::string_view kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_=+,.:/@%^~";
    std::ifstream file("/proc/self/cmdline", std::ios::binary);
    std::string line;
    for (std::string argument; std::getline(file, argument, '\0');) {
        if (line.empty()) {
            line = std::filesystem::path(argument).filename().string();
        } else if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) {
            line += " " + argument;
        } else {
            line += " '" + argument + "'";
        }
    }
    return line.empty() ? "terrane" : line;
}

nlohmann::ordered_json thinned(std::span<const FrameRecord> frames,
                               const std::function<double(const FrameRecord&)>& get) {
    nlohmann::ordered_json values = nlohmann::ordered_json::array();
    const std::size_t stride = (frames.size() + kMostPoints - 1) / kMostPoints;
    for (std::size_t first = 0; first < frames.size(); first += stride) {
        double most = get(frames[first]);
        for (std::size_t i = first + 1; i < std::min(first + stride, frames.size()); ++i) {
            most = std::max(most, get(frames[i]));
        }
        values.push_back(std::strtod(rounded_text(most, 6, Rounding::nearest).c_str(), nullptr));
    }
    return values;
}

Result<void> write_report(const OutputPlace& place, const ReportHeader& header,
                          nlohmann::ordered_json data, std::string_view script) {
    std::string film;
    if (!header.film.empty()) {
        film = "<video controls muted loop src=\"" + escaped(header.film) + "\"></video>";
    }
    data["summary"] = header.summary;
    data["rows"] = nlohmann::ordered_json::array();
    for (const auto& [key, value] : header.summary.items()) {
        data["rows"].push_back(
            {figure_title(key), figure_text(key, value), figure_note(key, header.summary), key});
    }
    const std::string page =
        filled(assets::report_html, {{"TITLE", escaped(header.title)},
                                     {"COMMAND", escaped(header.command_line)},
                                     {"FILM", film},
                                     {"DATA", script_safe(data)},
                                     {"CHART_JS", std::string(assets::chart_js)},
                                     {"REPORT_JS", std::string(assets::report_js)},
                                     {"SCRIPT", std::string(script)}});
    Result<OutputFile> file = OutputFile::create(place);
    if (!file) return tl::unexpected(file.error());
    file->write(page);
    return file->commit();
}

}  // namespace terrane::tools
