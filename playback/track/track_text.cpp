// SPDX-License-Identifier: MIT
// Tracks as lines of numbers: CSV and TUM.
#include "track/track_reading.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

namespace terrane::internal {
namespace {

std::vector<std::string_view> split(std::string_view line, std::string_view separators,
                                    bool skip_empty) {
    std::vector<std::string_view> fields;
    while (true) {
        const std::size_t end = line.find_first_of(separators);
        const std::string_view field = trimmed(line.substr(0, end));
        if (!skip_empty || !field.empty()) fields.push_back(field);
        if (end == std::string_view::npos) return fields;
        line.remove_prefix(end + 1);
    }
}

bool is_comment(std::string_view line) { return line.empty() || line.front() == '#'; }

// Indices of the columns; kNone if absent.
struct Columns {
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::size_t time = kNone, x = kNone, y = kNone, z = kNone;
    std::size_t count = 0;
};

std::size_t find_column(const std::vector<std::string_view>& names, std::string_view wanted,
                        std::string_view also) {
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::string name(names[i]);
        std::transform(name.begin(), name.end(), name.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        if (name == wanted || name == also) return i;
    }
    return Columns::kNone;
}

Result<Columns> read_header(std::string_view line, long number, const std::string& path) {
    const std::vector<std::string_view> names = split(line, ",", false);
    if (parse_number(names.front())) {
        if (names.size() == 4) return Columns{0, 1, 2, 3, 4};
        return refuse_line(
            path, number,
            "a track without a header has the four columns time_s,x_m,y_m,z_m, got " +
                number_text(names.size()) + " columns");
    }
    const Columns columns{
        find_column(names, "time_s", "time_s"), find_column(names, "x_m", "eye_x_m"),
        find_column(names, "y_m", "eye_y_m"), find_column(names, "z_m", "eye_z_m"), names.size()};
    if (columns.x == Columns::kNone || columns.y == Columns::kNone) {
        return refuse_line(path, number,
                           "the header must name the columns x_m and y_m, got " + quoted(line));
    }
    return columns;
}

/// The whole text as a finite number.
std::optional<double> parse_plain(std::string_view text) {
    double value = 0.0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
    return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
    if (const std::size_t slash = text.find('/'); slash != std::string_view::npos) {
        const std::optional<double> over = parse_plain(text.substr(0, slash));
        const std::optional<double> under = parse_plain(text.substr(slash + 1));
        if (!over || !under || !std::isfinite(*over / *under)) return std::nullopt;
        return *over / *under;
    }
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    return parse_plain(text);
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string quoted(std::string_view value) {
    constexpr std::size_t kLongest = 40;
    std::string shown(value.substr(0, kLongest));
    for (char& c : shown) {
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
    }
    return "'" + shown + (value.size() > kLongest ? "...'" : "'");
}

tl::unexpected<Error> refuse_line(const std::string& path, long line, const std::string& what) {
    return fail(ErrorCode::bad_data, path + ": line " + number_text(line) + ": " + what);
}

Result<void> for_each_line(const std::string& text,
                           const std::function<Result<void>(std::string_view, long)>& take) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    std::string_view rest = text;
    if (rest.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
        rest.remove_prefix(kByteOrderMark.size());
    }
    for (long number = 1; !rest.empty(); ++number) {
        const std::size_t end = rest.find('\n');
        if (const Result<void> taken = take(trimmed(rest.substr(0, end)), number); !taken)
            return taken;
        rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    }
    return {};
}

Result<RawTrack> read_csv(const std::string& text, const std::string& path) {
    RawTrack track;
    std::optional<Columns> columns;
    const auto take = [&](std::string_view line, long number) -> Result<void> {
        if (is_comment(line)) return {};
        if (!columns) {
            const Result<Columns> header = read_header(line, number, path);
            if (!header) return tl::unexpected(header.error());
            columns = *header;
            if (!parse_number(split(line, ",", false).front())) return {};
        }
        const std::vector<std::string_view> fields = split(line, ",", false);
        if (fields.size() != columns->count) {
            return refuse_line(path, number,
                               number_text(fields.size()) + " columns where the first line has " +
                                   number_text(columns->count));
        }
        RawPoint point;
        point.line = number;
        const std::array<std::pair<std::size_t, double*>, 4> wanted{{{columns->time, &point.time},
                                                                     {columns->x, &point.x},
                                                                     {columns->y, &point.y},
                                                                     {columns->z, &point.z}}};
        constexpr std::array<const char*, 4> kNames{"time_s", "x_m", "y_m", "z_m"};
        for (std::size_t i = 0; i < wanted.size(); ++i) {
            if (wanted[i].first == Columns::kNone) continue;
            const std::optional<double> value = parse_number(fields[wanted[i].first]);
            if (!value) {
                return refuse_line(path, number,
                                   std::string(kNames[i]) + " must be a finite number, got " +
                                       quoted(fields[wanted[i].first]));
            }
            *wanted[i].second = *value;
        }
        track.points.push_back(point);
        return {};
    };
    if (const Result<void> read = for_each_line(text, take); !read) {
        return tl::unexpected(read.error());
    }
    track.has_times = columns && columns->time != Columns::kNone;
    track.has_heights = columns && columns->z != Columns::kNone;
    return track;
}

Result<RawTrack> read_tum(const std::string& text, const std::string& path) {
    RawTrack track;
    track.has_times = track.has_heights = track.has_orientations = true;
    const auto take = [&](std::string_view line, long number) -> Result<void> {
        if (is_comment(line)) return {};
        const std::vector<std::string_view> fields = split(line, " \t", true);
        std::array<double, 8> value{};
        if (fields.size() != value.size()) {
            return refuse_line(path, number,
                               "a pose is 8 numbers, time x y z qx qy qz qw, got " +
                                   number_text(fields.size()) + ": " + quoted(line));
        }
        for (std::size_t i = 0; i < value.size(); ++i) {
            const std::optional<double> number_read = parse_number(fields[i]);
            if (!number_read) {
                return refuse_line(path, number,
                                   "a pose is 8 finite numbers, got " + quoted(fields[i]));
            }
            value[i] = *number_read;
        }
        const double qx = value[4], qy = value[5], qz = value[6], qw = value[7];
        const double squared = qx * qx + qy * qy + qz * qz + qw * qw;
        if (!(std::abs(squared - 1.0) < 0.02)) {
            return refuse_line(path, number,
                               "the rotation must have length 1, got " + number_text(qx) + " " +
                                   number_text(qy) + " " + number_text(qz) + " " + number_text(qw));
        }
        // from the columns of the rotation: z of the camera is forward, -y is up
        const double s = 2.0 / squared;
        const Eigen::Vector3d forward(s * (qx * qz + qw * qy), s * (qy * qz - qw * qx),
                                      1.0 - s * (qx * qx + qy * qy));
        const Eigen::Vector3d down(s * (qx * qy - qw * qz), 1.0 - s * (qx * qx + qz * qz),
                                   s * (qy * qz + qw * qx));
        track.points.push_back(
            {number, value[0], value[1], value[2], value[3], forward, Eigen::Vector3d(-down)});
        return {};
    };
    if (const Result<void> read = for_each_line(text, take); !read) {
        return tl::unexpected(read.error());
    }
    return track;
}

}  // namespace terrane::internal
