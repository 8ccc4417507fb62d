// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <functional>
#include <string>
#include <vector>

namespace terrane {

/// One point of a track.
struct TrackPoint {
    double time = 0.0;  ///< seconds since the track's first point; undefined without times
    WorldPos position_world = WorldPos::Zero();  ///< z is undefined without heights
    /// View and up direction of a camera, orthonormal; only with orientations.
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< see forward
};

/// A trajectory, such as one read from a file. Times, heights and orientations may be absent.
struct Track {
    std::vector<TrackPoint> points;  ///< at least two; times increase strictly, if present
    bool has_times = false;          ///< whether TrackPoint::time is valid
    bool has_heights = false;        ///< whether z is valid
    bool has_orientations = false;   ///< whether forward and up are valid
    /// Recorded by a receiver: positions are rounded and noisy, and heights refer to another datum than the ground's.
    bool is_recorded = false;
    /// What read_track() filled in or left out, in one line that names the file; "" for nothing.
    std::string note;

    /// Fails: invalid_argument, naming the point, for fewer than two points, numbers that are not finite, and times
    ///        that do not start at 0 and increase strictly
    Result<void> validate() const;
};

/// Places the longitudes and latitudes of a track in the world.
struct TrackReference {
    /// The world position of a longitude and latitude in WGS 84, degrees, and a height above the datum of the
    /// terrain's heights, such as Georeference::world_from_lonlat() of the component dem; NaN if it has none. Empty:
    /// the world has no place on the Earth.
    std::function<WorldPos(const Eigen::Vector3d& lonlat)> world_from_lonlat = {};
    std::string why_not = "this terrain has no raster";  ///< reason if it is empty, for messages
};

/// Reads a track in the format of the file extension:
///
///   .csv   lines of numbers under a header that names the columns x_m and y_m and optionally time_s and z_m (or
///          eye_x_m and so on, so that a frames.csv can be replayed). Other columns are ignored; Track::note names them
///          if times or heights are missing. Without a header, the columns are time_s,x_m,y_m,z_m. A z_m that is empty
///          or nan is missing
///   .gpx   the track points (trkpt) of all segments in order, with heights (ele) and times. A height is missing if
///          there is none, if it is -9999, -32768 or -99999, or if the fix is 2d; points whose fix is none are left out
///   .igc   the fixes (B records); heights are GNSS altitudes. One is missing if the fix is 2D (validity V), or if it
///          is 0 where others are not and the pressure altitude is beyond 400 m. Without any GNSS altitude, heights are
///          pressure altitudes. Fixes of validity V at longitude and latitude 0 have no position and are left out
///   .tum   lines of "time x y z qx qy qz qw", metres in the world; the rotation takes camera axes
///          (x right, y down, z forward) to world axes. Lines that start with # are comments
///
/// GPX and IGC coordinates are converted to world metres by the reference, before anything else is made of them.
/// Missing values are filled one by one, and Track::note counts them: heights linearly in time between the points
/// around, of IGC fixes from the pressure altitude shifted like the fixes around; times by the distance between the
/// points around. If no point has a height, or fewer than two have a time, the track has none. Points of equal times
/// are merged into their mean.
///
/// Fails: io if the file cannot be read; bad_data, naming file, line and value, if a line is invalid, times decrease,
///        or fewer than two points remain; invalid_argument for another extension, or for longitudes and latitudes if
///        the reference is empty
Result<Track> read_track(const std::string& path, const TrackReference& reference = {});

/// Whether a name refers to a track file rather than a built-in path: it has an extension of read_track(), or a '/'.
bool names_track_file(const std::string& path);

}  // namespace terrane
