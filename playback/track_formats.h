// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/playback/track.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::internal {

/// A point as read: position in the file's units, and its line for messages.
struct RawPoint {
    long line = 0;  ///< line number in the file, from 1
    double time = 0.0;
    double x = 0.0;  ///< metres, or degrees east
    double y = 0.0;  ///< metres, or degrees north
    double z = 0.0;
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    bool has_time = true;    ///< whether the point has a time, in a track with times
    bool has_height = true;  ///< whether the point has a measured height, in a track with heights
};

struct RawTrack {
    std::vector<RawPoint> points;
    bool has_times = false;    ///< whether any point has a time
    bool has_heights = false;  ///< whether any point has a measured height
    bool has_orientations = false;
    std::vector<std::string> notes;  ///< what the reader filled in or left out, one clause each
};

/// Readers, one per format. `text` is the content of the file, `path` is for messages. They fail with bad_data, naming
/// file, line and value.
Result<RawTrack> read_csv(const std::string& text, const std::string& path);
Result<RawTrack> read_tum(const std::string& text, const std::string& path);
Result<RawTrack> read_gpx(const std::string& text, const std::string& path);
Result<RawTrack> read_igc(const std::string& text, const std::string& path);

/// Fills values that are unknown: linearly in `at` between the known values before and after, and with the nearest
/// known value before the first and after the last one. Requires a known value.
///
/// @param at    such as times; where two known values have the same, or decreasing, `at`, indices take its place
/// @param known [values.size()] whether a value is known
void fill_unknown(const std::vector<double>& at, const std::vector<bool>& known,
                  std::vector<double>& values);

/// Calls `take` with each trimmed line and its number from 1; stops when `take` fails.
Result<void> for_each_line(const std::string& text,
                           const std::function<Result<void>(std::string_view, long)>& take);

/// Parses the whole text as a finite number or the quotient of two (1/60); absent for anything else.
std::optional<double> parse_number(std::string_view text);

/// A bad_data error: "path: line 7: what". Long quoted values are shortened.
tl::unexpected<Error> refuse_line(const std::string& path, long line, const std::string& what);
std::string quote(std::string_view value);
std::string_view trimmed(std::string_view text);

}  // namespace terrane::internal
