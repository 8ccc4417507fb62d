// SPDX-License-Identifier: MIT
#pragma once

#include "track/curve.h"

#include <terrane/terrain/height_source.h>

#include <optional>
#include <vector>

namespace terrane::tools {

/// Where a camera is and looks at one moment.
struct CameraPose {
    WorldPos eye_world = WorldPos::Zero();
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit, square to forward
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second
};

/// Control points of a leg: so many seconds apart, from so many before its beginning to as many
/// behind its end.
inline constexpr double kLegStep = 0.25;
inline constexpr double kLegPad = 8.0;
std::size_t control_count(double duration);
double control_time(std::size_t i);

/// What is planned of a leg before the ground under it is known.
struct LegPlan {
    double duration = 0.0;                 ///< seconds
    std::vector<Eigen::Vector3d> control;  ///< [control_count(duration)] places of the eye; z is 0
    bool has_lean = false;                 ///< leans into its turns
    std::optional<WorldPos> target_world;  ///< what it looks at, instead of ahead
    /// Where the view is turned to from where it would look: the cosine and the sine of an angle
    /// around the vertical. Empty: nowhere.
    SmoothCurve turn;
};

/// A stretch of a camera's path without a jump. Times count from its beginning.
class CameraLeg {
public:
    /// Flies a plan at an altitude over the smoothed ground.
    ///
    /// Fails: io where the terrain cannot be read
    static Result<CameraLeg> create(LegPlan plan, const HeightSource& source, double altitude,
                                    double speed);

    /// Follows a track with times.
    ///
    /// @param start    seconds of the track that are left out; before its end
    /// @param duration of the leg, from there
    /// @param altitude over the smoothed ground, instead of the track's own heights; required where
    ///                 it has none
    static Result<CameraLeg> create(Track track, const HeightSource& source, double start,
                                    double duration, std::optional<double> altitude);

    double duration() const { return duration_; }
    CameraPose at(double time) const;

private:
    CameraLeg() = default;

    CurvePoint eye(double time) const;
    Result<void> fit_heights(const HeightSource& source, double altitude, double clearance,
                             double speed);
    void fit_orientation(double ahead, bool has_lean);

    double duration_ = 0.0;
    double start_ = 0.0;     // of the track
    SmoothCurve plan_;       // the eye; a plan's
    TrackCurve track_plan_;  // the eye; a track's
    bool has_own_heights_ = false;
    SmoothCurve heights_;  // z: the eye's height, or what is added to its own
    std::optional<WorldPos> target_world_;
    SmoothCurve forward_;
    SmoothCurve up_;
    SmoothCurve turn_;
    std::vector<TrackPoint> orientations_;  // of a track that has them
};

}  // namespace terrane::tools
