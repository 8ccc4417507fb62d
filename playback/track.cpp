// SPDX-License-Identifier: MIT
#include "track_formats.h"

#include <terrane/base/text.h>
#include <terrane/playback/track.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
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

// A number with all its digits: number_text() has six, with which times since 1970 look alike.
std::string exact_text(double value) {
    std::array<char, 32> text{};
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
    return {text.data(), end};
}

// Fails for decreasing times. Points without a time are left out.
Result<void> check_order(const RawTrack& track, const std::string& path) {
    const RawPoint* last = nullptr;
    for (const RawPoint& point : track.points) {
        if (!track.has_times || !point.has_time) continue;
        if (last != nullptr && point.time < last->time) {
            return refuse_line(path, point.line,
                               "time goes back by " + number_text(last->time - point.time) +
                                   " s, from " + exact_text(last->time) + " to " +
                                   exact_text(point.time) + " s");
        }
        last = &point;
    }
    return {};
}

// Merges points of equal times into their mean.
void merge_times(std::vector<RawPoint>& points) {
    std::vector<RawPoint> merged;
    for (std::size_t i = 0; i < points.size();) {
        RawPoint mean = points[i];
        std::size_t next = i + 1;
        for (; next < points.size() && points[next].time <= mean.time; ++next) {
            mean.x += points[next].x;
            mean.y += points[next].y;
            mean.z += points[next].z;
        }
        const auto count = static_cast<double>(next - i);
        mean.x /= count;
        mean.y /= count;
        mean.z /= count;
        merged.push_back(mean);
        i = next;
    }
    points = std::move(merged);
}

// One value of each point of a track, and whether the point has it.
struct PointValues {
    std::vector<double> values;
    std::vector<bool> known;

    PointValues(const std::vector<RawPoint>& points, double RawPoint::*member,
                bool RawPoint::*has_member) {
        for (const RawPoint& point : points) {
            values.push_back(point.*member);
            known.push_back(point.*has_member);
        }
    }
    std::size_t missing() const {
        return static_cast<std::size_t>(std::ranges::count(known, false));
    }
};

// Fills the times of the points without one, by the distance `along` the track. Before the first and after the last
// known time the track goes on at its mean speed.
void fill_times(RawTrack& track, const std::vector<double>& along) {
    PointValues time(track.points, &RawPoint::time, &RawPoint::has_time);
    const std::size_t count = track.points.size(), missing = time.missing();
    if (!track.has_times || missing == 0) return;
    if (missing + 1 == count) {
        track.has_times = false;
        track.notes.push_back("only 1 of " + number_text(count) +
                              " points has a time: the track is taken to have none");
        return;
    }
    std::size_t first = 0, last = count - 1;
    while (!time.known[first]) ++first;
    while (!time.known[last]) --last;
    const double length = along[last] - along[first];
    const double pace = length > 0.0 ? (time.values[last] - time.values[first]) / length : 0.0;
    time.values[0] = time.values[first] - pace * (along[first] - along[0]);
    time.values[count - 1] = time.values[last] + pace * (along[count - 1] - along[last]);
    time.known[0] = time.known[count - 1] = true;
    internal::fill_unknown(along, time.known, time.values);
    for (std::size_t i = 0; i < count; ++i) track.points[i].time = time.values[i];
    track.notes.push_back(number_text(missing) + " of " + number_text(count) +
                          " points have no time: filled by their distance from those around");
}

// Fills the heights of the points without one, by time, or by the distance `along` a track without times.
void fill_heights(RawTrack& track, const std::vector<double>& along) {
    PointValues height(track.points, &RawPoint::z, &RawPoint::has_height);
    const std::size_t missing = height.missing();
    if (!track.has_heights || missing == 0) return;
    const PointValues time(track.points, &RawPoint::time, &RawPoint::has_time);
    internal::fill_unknown(track.has_times ? time.values : along, height.known, height.values);
    for (std::size_t i = 0; i < track.points.size(); ++i) track.points[i].z = height.values[i];
    track.notes.push_back(number_text(missing) + " of " + number_text(track.points.size()) +
                          " points have no height: filled from those around");
}

// The distance of each point from the first along the track, in plan, metres.
std::vector<double> distances(const std::vector<RawPoint>& points) {
    std::vector<double> along{0.0};
    for (std::size_t i = 1; i < points.size(); ++i) {
        along.push_back(along.back() +
                        std::hypot(points[i].x - points[i - 1].x, points[i].y - points[i - 1].y));
    }
    return along;
}

std::string join(const std::vector<std::string>& clauses) {
    std::string text;
    for (const std::string& clause : clauses) text += (text.empty() ? "" : "; ") + clause;
    return text;
}

Result<void> project(std::vector<RawPoint>& points, const TrackReference& reference,
                     const std::string& path) {
    if (!reference.world_from_lonlat) {
        return fail(ErrorCode::invalid_argument,
                    path + " gives longitudes and latitudes, which need a raster with a CRS; " +
                        reference.why_not);
    }
    for (RawPoint& point : points) {
        const auto refuse = [&](const std::string& what) {
            return refuse_line(path, point.line,
                               "longitude " + number_text(point.x) + ", latitude " +
                                   number_text(point.y) + " is " + what);
        };
        if (!(std::abs(point.x) <= 360.0 && std::abs(point.y) <= 90.0)) {
            return refuse("no place on the Earth");
        }
        const WorldPos p_world =
            reference.world_from_lonlat({point.x, point.y, point.has_height ? point.z : 0.0});
        if (!p_world.head<2>().allFinite()) {
            return refuse("outside of the projection of the terrain's raster");
        }
        point.x = p_world.x();
        point.y = p_world.y();
        if (point.has_height) point.z = p_world.z();
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
            return refuse("must be later than the one before at " + exact_text(before) +
                          " s, got " + exact_text(point.time) + " s");
        }
    }
    return {};
}

bool names_track_file(const std::string& path) {
    return find_format(path) != nullptr || path.find('/') != std::string::npos;
}

Result<Track> read_track(const std::string& path, const TrackReference& reference) {
    const Format* format = find_format(path);
    if (format == nullptr) {
        return fail(ErrorCode::invalid_argument,
                    "a track is a .csv, .gpx, .igc or .tum file, got " + path);
    }
    TERRANE_TRY(const std::string text, read_text(path));
    const bool is_utf_16 = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff");
    if (is_utf_16 && format->read != &internal::read_gpx) {
        return fail(ErrorCode::bad_data,
                    path + " is UTF-16 text, which only .gpx may be: save it as UTF-8");
    }
    TERRANE_TRY(RawTrack raw, format->read(text, path));

    std::vector<RawPoint>& points = raw.points;
    const auto check_count = [&]() -> Result<void> {
        if (points.size() >= 2) return {};
        return fail(ErrorCode::bad_data, path + ": a track needs two points or more, got " +
                                             number_text(points.size()) +
                                             (raw.notes.empty() ? "" : ": " + join(raw.notes)));
    };
    TERRANE_TRY(check_order(raw, path));
    TERRANE_TRY(check_count());
    if (format->is_geographic) {
        TERRANE_TRY(project(points, reference, path));
    }
    const std::vector<double> along = distances(points);
    fill_times(raw, along);
    fill_heights(raw, along);
    if (raw.has_times) merge_times(points);
    TERRANE_TRY(check_count());

    Track track;
    track.has_times = raw.has_times;
    track.has_heights = raw.has_heights;
    track.has_orientations = raw.has_orientations;
    track.is_recorded = format->is_geographic;
    if (!raw.notes.empty()) track.note = path + ": " + join(raw.notes);
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
