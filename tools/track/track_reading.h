// SPDX-License-Identifier: MIT
#pragma once

#include "track/track.h"

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// A track while it is read: positions are in the file's own terms, and lines are kept for messages.
struct RawPoint {
    long line = 0;  ///< of the file, from 1
    double time = 0.0;
    double x = 0.0;  ///< metres, or degrees east
    double y = 0.0;  ///< metres, or degrees north
    double z = 0.0;
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

struct RawTrack {
    std::vector<RawPoint> points;
    bool has_times = false;
    bool has_heights = false;
    bool has_orientations = false;
};

/// One reader for each format; `text` is the whole file, `path` is for messages.
/// Fail with bad_data, naming file, line and value.
Result<RawTrack> read_csv(const std::string& text, const std::string& path);
Result<RawTrack> read_tum(const std::string& text, const std::string& path);
Result<RawTrack> read_gpx(const std::string& text, const std::string& path);
Result<RawTrack> read_igc(const std::string& text, const std::string& path);

/// Calls `take` with each line and its number from 1, without line ends and outer blanks, until it
/// fails.
Result<void> for_each_line(const std::string& text,
                           const std::function<Result<void>(std::string_view, long)>& take);

/// bad_data: "path: line 7: what". Values that are quoted in it are cut where they are long.
tl::unexpected<Error> refuse_line(const std::string& path, long line, const std::string& what);
std::string quoted(std::string_view value);
std::string_view trimmed(std::string_view text);

}  // namespace terrane::tools
