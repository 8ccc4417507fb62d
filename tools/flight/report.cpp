// SPDX-License-Identifier: MIT
#include "flight/report.h"

#include "assets.h"
#include "program/output_file.h"
#include "program/summary.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
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
    return write_file(place, page);
}

namespace {

nlohmann::ordered_json make_data(const FlightLog& log, std::size_t memory_bytes) {
    const std::span<const FrameRecord> frames = log.frames();
    constexpr double kMegabyte = 0x1p20;
    nlohmann::ordered_json data;
    const auto add = [&](const char* name, const std::function<double(const FrameRecord&)>& get) {
        data[name] = thinned(frames, get);
    };
    add("time", [](const FrameRecord& r) { return r.time; });
    add("triangles", [](const FrameRecord& r) { return static_cast<double>(r.triangles); });
    add("error", [](const FrameRecord& r) { return r.error_px; });
    add("update", [](const FrameRecord& r) { return r.update_ms; });
    add("resident", [](const FrameRecord& r) {
        return static_cast<double>(r.paging.resident_bytes) / kMegabyte;
    });
    add("late", [](const FrameRecord& r) { return static_cast<double>(r.paging.late_chunks); });
    if (!frames.empty() && frames.front().measured_error_px) {
        add("measured", [](const FrameRecord& r) { return r.measured_error_px.value_or(0.0); });
        add("pop", [](const FrameRecord& r) { return r.max_pop_px.value_or(0.0); });
    }
    data["budget"] = frames.empty() ? 0 : frames.front().budget;
    data["ceiling"] = static_cast<double>(memory_bytes) / kMegabyte;
    data["extra"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < log.extra_columns().size(); ++i) {
        data["extra"].push_back(
            {{"name", log.extra_columns()[i]},
             {"title", figure_title(log.extra_columns()[i])},
             {"values", thinned(frames, [i](const FrameRecord& r) { return r.extra[i]; })}});
    }
    return data;
}

}  // namespace

Result<void> write_flight_report(const OutputPlace& place, const ReportHeader& header,
                                 const FlightLog& log, std::size_t memory_bytes) {
    nlohmann::ordered_json data = make_data(log, memory_bytes);
    data["note"] = figure_note("error_px_max", header.summary);
    return write_report(place, header, std::move(data), assets::flight_js);
}

}  // namespace terrane::tools
