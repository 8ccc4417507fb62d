// SPDX-License-Identifier: MIT
#include "program/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string_view>
#include <vector>

namespace terrane::tools {
namespace {

constexpr int kMeasuredDigits = 4, kPlaceDigits = 9;

template <std::size_t N>
bool is_one_of(const std::string& key, const std::array<std::string_view, N>& keys) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
}

// Coordinates, heights and grid sizes: 9 digits.
constexpr std::array<std::string_view, 18> kPlaces{
    "extent_m",         "min_m",     "max_m",        "root_size_m",     "lattice_origin_m",
    "finest_spacing_m", "cell_m",    "centre",       "metres_per_unit", "eye_m",
    "forward",          "quantum_m", "guaranteed_m", "voxel_m",         "bounds_m",
    "stuck_at",         "lonlat",    "scale"};

// Echoes of the command line: not rounded.
constexpr std::array<std::string_view, 11> kEchoed{
    "speed", "altitude", "radius",    "latency_ms",   "bandwidth_mb", "memory_mb",
    "fps",   "seconds",  "horizon_s", "max_error_px", "budget"};

// Certified bounds: rounded up.
constexpr std::array<std::string_view, 7> kBounds{
    "error_px", "object_error_px", "error_px_max", "error_px_median",
    "error_m",  "max_error_m",     "scale_error"};

const std::map<std::string, std::string>& own_titles() {
    static const std::map<std::string, std::string> titles{
        {"error_px", "Certified screen error, px"},
        {"error_px_median", "Certified screen error (median), px"},
        {"error_px_max", "Certified screen error (most), px"},
        {"measured_error_px_max", "Measured screen error (most), px"},
        {"max_pop_px", "Movement between frames (most), px"},
        {"max_pop_elsewhere_px", "Movement elsewhere (most), px"},
        {"max_solid_pop_px", "Movement of volumes between frames (most), px"},
        {"pop_frames", "Frames that move too far"},
        {"uncertified_frames", "Frames whose measured error is above the certified one"},
        {"points_min", "Points measured in a frame (least)"},
        {"gpu_ms_median", "Time of the device (median), ms"},
        {"late_frames", "Frames above the target because of absent chunks"},
        {"excess_error_px_s", "Screen error above the target, over time, px s"},
        {"late_excess_error_px_s", "Of it because of absent chunks, px s"},
        {"not_resident_frames", "Frames with absent chunks"},
        {"memory_bytes", "Ceiling of memory, bytes"},
        {"peak_bytes", "Memory (most), bytes"},
        {"over_ceiling", "Times over the ceiling of memory"},
        {"max_depth_m", "Depth in the ground (most), m"},
        {"fell_through", "Body steps deeper than the tolerance"},
        {"parked", "Body steps that waited for ground"},
        {"left_world", "Bodies beyond the terrain"},
        {"airborne_share", "Share of steps without a wheel on the ground"},
        {"path_share", "Share of the path that was passed"},
        {"stuck_s", "Time without progress along the path, s"},
        {"stuck_at", "Stuck at x and y, m"},
        {"lost_time_share", "Share of time that was not simulated"},
        {"fps", "Frames a second"},
        {"slots", "Requests at once"},
        {"out", "Folder"},
    };
    return titles;
}

const std::map<std::string, std::string>& words_of_statistics() {
    static const std::map<std::string, std::string> words{
        {"max", "most"}, {"min", "least"}, {"median", "median"}, {"p99", "99 %"}};
    return words;
}

bool is_unit(const std::string& word) {
    return word == "m" || word == "s" || word == "ms" || word == "px" || word == "bytes" ||
           word == "mb";
}

std::vector<std::string> words_of(const std::string& key) {
    std::vector<std::string> words(1);
    for (const char c : key) {
        if (c == '_') {
            words.emplace_back();
        } else {
            words.back() += c;
        }
    }
    return words;
}

}  // namespace

std::string rounded_text(double value, int digits, Rounding rounding) {
    if (!std::isfinite(value) || value == 0.0) return fmt::format("{}", value + 0.0);
    // "d.ddde+xx", rounded to nearest
    const std::string nearest = fmt::format("{:.{}e}", std::abs(value), digits - 1);
    double shown = std::strtod(nearest.c_str(), nullptr);
    const bool is_outward = (rounding == Rounding::up) == (value > 0.0);
    const bool is_wrong = rounding != Rounding::nearest &&
                          (is_outward ? shown < std::abs(value) : shown > std::abs(value));
    if (is_wrong) {
        // changes the last digit by one unit; computes with the digits as an integer, to be exact
        const std::size_t exponent_at = nearest.find('e');
        std::string mantissa = nearest.substr(0, exponent_at);
        std::erase(mantissa, '.');
        const long long units = std::strtoll(mantissa.c_str(), nullptr, 10) + (is_outward ? 1 : -1);
        const int exponent = std::atoi(nearest.c_str() + exponent_at + 1) - (digits - 1);
        shown = std::strtod(fmt::format("{}e{}", units, exponent).c_str(), nullptr);
    }
    return fmt::format("{}", std::copysign(shown, value));
}

std::string figure_text(const std::string& key, const nlohmann::ordered_json& value) {
    if (value.is_string()) {
        const auto& text = value.get_ref<const std::string&>();
        return text.empty() ? "-" : text;
    }
    if (value.is_array()) {
        std::string text;
        for (const nlohmann::ordered_json& item : value) {
            if (!text.empty()) text += ", ";
            text += figure_text(key, item);
        }
        return text;
    }
    if (value.is_object()) {
        std::string text;
        for (const auto& [name, item] : value.items()) {
            if (!text.empty()) text += ", ";
            text += name + " " + figure_text(name, item);
        }
        return text;
    }
    if (value.is_null()) return "-";
    if (!value.is_number_float() || is_one_of(key, kEchoed)) {
        return value.is_number_float() ? fmt::format("{}", value.get<double>()) : to_line(value);
    }
    if (is_one_of(key, kPlaces)) {
        return rounded_text(value.get<double>(), kPlaceDigits, Rounding::nearest);
    }
    return rounded_text(value.get<double>(), kMeasuredDigits,
                        is_one_of(key, kBounds) ? Rounding::up : Rounding::nearest);
}

std::string figure_title(const std::string& key) {
    if (const auto own = own_titles().find(key); own != own_titles().end()) return own->second;
    std::string title, unit, statistic;
    for (const std::string& word : words_of(key)) {
        if (const auto found = words_of_statistics().find(word);
            found != words_of_statistics().end() && !title.empty()) {
            statistic = " (" + found->second + ")";
        } else if (is_unit(word) && !title.empty()) {
            unit += (unit.empty() ? ", " : "/") + (word == "mb" ? "MB" : word);
        } else {
            title += (title.empty() ? "" : " ") + word;
        }
    }
    if (title.empty()) return key;
    title.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(title.front())));
    return title + statistic + unit;
}

std::string figure_note(const std::string& key, const nlohmann::ordered_json& summary) {
    const bool is_drive = summary.contains("distance_m") && summary.contains("frames");
    if (is_drive && key == "error_px_max") {
        return "an angle at the eye, which is a few metres over the ground here: what is off by a "
               "metre a metre away is hundreds of px";
    }
    return "";
}

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
    print_text(format_summary(summary, as_json));
}

void print_text(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stdout); }

void print_note(std::string_view note) {
    const std::string line = fmt::format("terrane: {}\n", note);
    std::fwrite(line.data(), 1, line.size(), stderr);
}

nlohmann::ordered_json number_or_null(const std::optional<double>& number) {
    return number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json();
}

}  // namespace terrane::tools
