// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/math.h>

#include <string>
#include <vector>

namespace terrane::tools {

/// One place of a track.
struct TrackPoint {
    double time = 0.0;  ///< seconds since the track's first point; meaningless without times
    WorldPos position_world = WorldPos::Zero();  ///< z is meaningless without heights
    /// Where a camera looks and what is up for it, unit and square to each other; only with
    /// orientations.
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

/// A way through the world, as a file tells it. What a file does not tell is left to its user.
struct Track {
    std::vector<TrackPoint> points;  ///< at least two; times strictly increase where there are any
    bool has_times = false;
    bool has_heights = false;
    bool has_orientations = false;
    /// Measured by a receiver: rounded, noisy, and heights are above another datum than the ground's.
    bool is_recorded = false;
};

/// Reads a track. The file's extension says what it is:
///
///   .csv   lines of numbers under a header that names the columns x_m and y_m and, where known,
///          time_s and z_m (eye_x_m and so on are read too, so that a frames.csv can be flown
///          again; other columns are passed over); without a header, lines of time_s,x_m,y_m,z_m
///   .gpx   the track points (trkpt) of all segments in order; ele and time where all have them
///   .igc   the fixes (B records); GNSS altitudes, or pressure altitudes where there are none
///   .tum   lines of "time x y z qx qy qz qw", metres in the world; the rotation takes camera axes
///          (x right, y down, z forward) to world axes. Lines that begin with # are comments
///
/// GPX and IGC places are brought to world metres by the raster's centre and scale. Points at one
/// and the same time become their mean.
///
/// @param dem what the terrain's raster is, or nullptr
///
/// Fails: io where the file cannot be read; bad_data, naming file, line and value, where a line makes
///        no sense, times go back, or fewer than two points are left; invalid_argument for another
///        extension, or for longitudes and latitudes where the terrain has none
Result<Track> read_track(const std::string& path, const DemInfo* dem);

/// Whether a --path names a file rather than one of the built-in paths: it has an extension that
/// read_track() knows, or a folder.
bool names_track_file(const std::string& path);

}  // namespace terrane::tools
