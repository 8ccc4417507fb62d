// SPDX-License-Identifier: MIT
#include "track_formats.h"

#include <terrane/base/text.h>
#include <terrane/playback/track.h>

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

namespace terrane {
namespace {

using internal::RawPoint;
using internal::RawTrack;
using internal::refuse_line;

using Reader = Result<RawTrack> (*)(const std::string&, const std::string&);

struct Format {
    std::string_view extension;
    Reader read;
    bool is_geographic;
};
constexpr std::array<Format, 4> kFormats{{{".csv", &internal::read_csv, false},
                                          {".gpx", &internal::read_gpx, true},
                                          {".igc", &internal::read_igc, true},
                                          {".tum", &internal::read_tum, false}}};

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

// Merges points of equal times into their mean; fails for decreasing times.
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
                               "time goes back from " + number_text(mean.time) + " to " +
                                   number_text(points[next].time) + " s");
        }
        ordered.push_back(mean);
        i = next;
    }
    points = std::move(ordered);
    return {};
}

Result<void> project(std::vector<RawPoint>& points, const GeoReference& reference,
                     const std::string& path) {
    if (!reference.is_geographic) {
        return fail(ErrorCode::invalid_argument,
                    path + " gives longitudes and latitudes, which need a raster in degrees; " +
                        reference.why_not);
    }
    for (RawPoint& point : points) {
        if (std::abs(point.x) > 180.0 || std::abs(point.y) > 90.0) {
            return refuse_line(path, point.line,
                               "longitude " + number_text(point.x) + ", latitude " +
                                   number_text(point.y) + " is no place on the Earth");
        }
        point.x = (point.x - reference.longitude) * reference.metres_per_degree_x;
        point.y = (point.y - reference.latitude) * reference.metres_per_degree_y;
    }
    return {};
}

}  // namespace

Result<void> Track::validate() const {
    if (points.size() < 2) {
        return fail(ErrorCode::invalid_argument,
                    "a track needs two points or more, got " + number_text(points.size()));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const TrackPoint& point = points[i];
        const auto refuse = [i](const std::string& what) {
            return fail(ErrorCode::invalid_argument,
                        "point " + number_text(i) + " of a track " + what);
        };
        if (!point.position_world.allFinite()) return refuse("must have a finite position");
        if (has_orientations && !(point.forward.allFinite() && point.up.allFinite())) {
            return refuse("must have finite directions");
        }
        if (!has_times) continue;
        if (i == 0) {
            if (point.time != 0.0) {
                return refuse("must have the time 0, got " + number_text(point.time) + " s");
            }
            continue;
        }
        const double before = points[i - 1].time;
        if (!(point.time > before && std::isfinite(point.time))) {
            return refuse("must be later than the one before at " + number_text(before) +
                          " s, got " + number_text(point.time) + " s");
        }
    }
    return {};
}

bool names_track_file(const std::string& path) {
    return find_format(path) != nullptr || path.find('/') != std::string::npos;
}

Result<Track> read_track(const std::string& path, const GeoReference& reference) {
    const Format* format = find_format(path);
    if (format == nullptr) {
        return fail(ErrorCode::invalid_argument,
                    "a track is a .csv, .gpx, .igc or .tum file, got " + path);
    }
    TERRANE_TRY(const std::string text, read_text(path));
    TERRANE_TRY(RawTrack raw, format->read(text, path));

    std::vector<RawPoint>& points = raw.points;
    if (raw.has_times) {
        TERRANE_TRY(order_in_time(points, path));
    }
    if (points.size() < 2) {
        return fail(ErrorCode::bad_data,
                    path + ": a track needs two points or more, got " + number_text(points.size()));
    }
    if (format->is_geographic) {
        TERRANE_TRY(project(points, reference, path));
    }

    Track track;
    track.has_times = raw.has_times;
    track.has_heights = raw.has_heights;
    track.has_orientations = raw.has_orientations;
    track.is_recorded = format->is_geographic;
    track.points.reserve(points.size());
    for (const RawPoint& point : points) {
        track.points.push_back({raw.has_times ? point.time - points.front().time : 0.0,
                                WorldPos(point.x, point.y, point.z), point.forward, point.up});
    }
    // Near the limits of a double, differences of times may vanish and sums of coordinates may be infinite.
    if (const Result<void> good = track.validate(); !good) {
        return fail(ErrorCode::bad_data, path + ": " + good.error().message);
    }
    return track;
}

}  // namespace terrane
