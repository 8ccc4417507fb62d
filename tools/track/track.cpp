// SPDX-License-Identifier: MIT
#include "track/track.h"

#include "track/track_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace terrane::tools {
namespace {

using Reader = Result<RawTrack> (*)(const std::string&, const std::string&);

struct Format {
    std::string_view extension;
    Reader read;
    bool is_geographic;
};
constexpr std::array<Format, 4> kFormats{{{".csv", &read_csv, false},
                                          {".gpx", &read_gpx, true},
                                          {".igc", &read_igc, true},
                                          {".tum", &read_tum, false}}};

std::string lower_extension(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

const Format* find_format(const std::string& path) {
    const std::string extension = lower_extension(path);
    const auto* found = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) {
        return format.extension == extension;
    });
    return found == kFormats.end() ? nullptr : found;
}

Result<std::string> read_text(const std::string& path) {
    const auto refuse = [&path](const std::string& why) {
        return fail(ErrorCode::io, "cannot read the track '" + path + "': " + why);
    };
    std::error_code ignored;
    std::ifstream file(path, std::ios::binary);
    if (!file) return refuse(std::strerror(errno));
    if (std::filesystem::is_directory(path, ignored)) return refuse("it is a folder");
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (file.bad()) return refuse(std::strerror(errno));
    return text;
}

// Merges points of equal times into their mean; refuses decreasing times.
Result<void> order_in_time(std::vector<RawPoint>& points, const std::string& path) {
    std::vector<RawPoint> ordered;
    for (std::size_t i = 0; i < points.size();) {
        RawPoint mean = points[i];
        std::size_t next = i + 1;
        for (; next < points.size() && points[next].time == mean.time; ++next) {
            mean.x += points[next].x;
            mean.y += points[next].y;
            mean.z += points[next].z;
        }
        const auto count = static_cast<double>(next - i);
        mean.x /= count;
        mean.y /= count;
        mean.z /= count;
        if (next < points.size() && points[next].time < mean.time) {
            return refuse_line(path, points[next].line,
                               fmt::format("time goes back from {:.6g} to {:.6g} s", mean.time,
                                           points[next].time));
        }
        ordered.push_back(mean);
        i = next;
    }
    points = std::move(ordered);
    return {};
}

Result<void> project(std::vector<RawPoint>& points, const DemInfo* dem, const std::string& path) {
    if (dem == nullptr || !dem->geographic) {
        return fail(ErrorCode::invalid_argument,
                    path + " gives longitudes and latitudes, which need a raster in degrees; " +
                        (dem == nullptr     ? std::string("this terrain has no raster")
                         : dem->crs.empty() ? std::string("this raster has no CRS")
                                            : "this raster's CRS is " + dem->crs));
    }
    for (RawPoint& point : points) {
        if (std::abs(point.x) > 180.0 || std::abs(point.y) > 90.0) {
            return refuse_line(
                path, point.line,
                fmt::format("longitude {:.6g}, latitude {:.6g} is no place on the Earth", point.x,
                            point.y));
        }
        point.x = (point.x - dem->centre_x) * dem->metres_per_unit_x;
        point.y = (point.y - dem->centre_y) * dem->metres_per_unit_y;
    }
    return {};
}

}  // namespace

bool names_track_file(const std::string& path) {
    return find_format(path) != nullptr || path.find('/') != std::string::npos;
}

Result<Track> read_track(const std::string& path, const DemInfo* dem) {
    const Format* format = find_format(path);
    if (format == nullptr) {
        return fail(ErrorCode::invalid_argument,
                    "a track is a .csv, .gpx, .igc or .tum file, got " + path);
    }
    const Result<std::string> text = read_text(path);
    if (!text) return tl::unexpected(text.error());
    Result<RawTrack> raw = format->read(*text, path);
    if (!raw) return tl::unexpected(raw.error());

    std::vector<RawPoint>& points = raw->points;
    if (raw->has_times) {
        if (const Result<void> good = order_in_time(points, path); !good) {
            return tl::unexpected(good.error());
        }
    }
    if (points.size() < 2) {
        return fail(ErrorCode::bad_data, fmt::format("{}: a track needs two points or more, got {}",
                                                     path, points.size()));
    }
    if (format->is_geographic) {
        if (const Result<void> good = project(points, dem, path); !good) {
            return tl::unexpected(good.error());
        }
    }

    Track track;
    track.has_times = raw->has_times;
    track.has_heights = raw->has_heights;
    track.has_orientations = raw->has_orientations;
    track.is_recorded = format->is_geographic;
    track.points.reserve(points.size());
    for (const RawPoint& point : points) {
        track.points.push_back({raw->has_times ? point.time - points.front().time : 0.0,
                                WorldPos(point.x, point.y, point.z), point.forward, point.up});
    }
    return track;
}

}  // namespace terrane::tools
