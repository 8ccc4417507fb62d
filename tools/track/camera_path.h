// SPDX-License-Identifier: MIT
#pragma once

#include "track/curve.h"

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/view.h>

#include <optional>
#include <string>

namespace terrane::tools {

struct CameraPathSettings {
    /// Metres a second over the plane, > 0. Absent: a track's own times, or kDefaultSpeed.
    std::optional<double> speed = std::nullopt;
    /// Metres above the ground, > 0, kept smooth: see CameraPath. Absent: a track's own heights, or
    /// kDefaultAltitude.
    std::optional<double> altitude = std::nullopt;
    double start = 0.0;  ///< seconds of a track that are left out at its beginning, >= 0
    std::optional<double> seconds =
        std::nullopt;  ///< > 0; absent: all of a track, or kDefaultSeconds

    static constexpr double kDefaultSpeed = 100.0;
    static constexpr double kDefaultAltitude = 200.0;
    static constexpr double kDefaultSeconds = 20.0;
};

/// Where a camera is and looks at one moment.
struct CameraPose {
    WorldPos eye_world = WorldPos::Zero();
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit, square to forward
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second
};

/// The way of a camera through time: a pure function of the terrain, the settings and the track.
///
///   straight   along the middle of the terrain's longer side
///   orbit      around the middle, looking at it; one turn where there is room for it
///   canyon     along the valleys of the terrain's roughest part, leaning into the turns
///
/// A built-in path that is longer than the terrain goes on straight beyond it. A camera at an
/// altitude flies that high above the smoothed ground, higher where a ridge would come closer than
/// half the altitude. A recorded track that comes closer to the ground than 2 m is lifted there; the
/// heights of other tracks are taken as they are.
class CameraPath {
public:
    /// Whether a name is one of the built-in paths.
    static bool is_built_in(const std::string& name);

    /// Fails: invalid_argument for a name that is no built-in path; io where the terrain cannot be
    ///        read
    static Result<CameraPath> create(const std::string& built_in, const HeightSource& source,
                                     const CameraPathSettings& settings);

    /// Fails: invalid_argument where the start lies behind the track's end, or all points are one
    ///        place and there are no times
    static Result<CameraPath> create(Track track, const HeightSource& source,
                                     const CameraPathSettings& settings);

    /// Seconds that it lasts.
    double duration() const { return duration_; }
    /// The pose at a time from 0 to duration().
    CameraPose at(double time) const;

private:
    CameraPath() = default;

    CurvePoint eye(double time) const;
    Result<void> fit_heights(const HeightSource& source, double altitude, double clearance,
                             double speed);
    void fit_look(double ahead, bool has_lean);

    double duration_ = 0.0;
    double start_ = 0.0;     // of the track
    SmoothCurve plan_;       // the eye; a built-in's
    TrackCurve track_plan_;  // the eye; a track's
    bool has_own_heights_ = false;
    SmoothCurve heights_;                   // z: the eye's height, or what is added to its own
    std::optional<WorldPos> target_world_;  // what an orbit looks at
    SmoothCurve forward_;
    SmoothCurve up_;
    std::vector<TrackPoint> orientations_;  // of a track that has them
};

}  // namespace terrane::tools
