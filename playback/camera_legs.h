// SPDX-License-Identifier: MIT
#pragma once

#include "curve.h"
#include "ground_route.h"

#include <terrane/playback/camera_path.h>
#include <terrane/terrain/height_source.h>

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace terrane::internal {

/// Control points of a leg are kLegStep seconds apart, from kLegPad seconds before its start to kLegPad seconds
/// after its end.
inline constexpr double kLegStep = 0.25;
inline constexpr double kLegPad = 8.0;
std::size_t control_count(double duration);
double control_time(std::size_t i);

/// A leg in the horizontal plane, before heights are fitted to the ground.
struct LegPlan {
    double duration = 0.0;                 ///< seconds
    std::vector<Eigen::Vector3d> control;  ///< [control_count(duration)] eye positions with z = 0
    bool has_lean = false;                 ///< whether the camera banks in turns
    std::optional<WorldPos> target_world;  ///< look-at point; absent: looks along the path
    /// Rotation of the view direction about the vertical over time: (cosine, sine). Empty if the view does not rotate.
    SmoothCurve turn;
};

/// A continuous part of a camera path. Times are seconds from its start.
class CameraLeg {
public:
    /// Follows a plan at an altitude above the smoothed ground.
    ///
    /// Fails: io if the terrain cannot be read
    static Result<CameraLeg> create(LegPlan plan, const HeightSource& source, double altitude,
                                    double speed);

    /// Follows a track with times.
    ///
    /// @param start    seconds to skip at the start of the track; less than its duration
    /// @param duration of the leg, seconds
    /// @param altitude above the smoothed ground; replaces the track's heights, and is required if the track has none
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
    double start_ = 0.0;     // seconds of the track to skip
    SmoothCurve plan_;       // eye position of a plan
    TrackCurve track_plan_;  // eye position of a track
    bool has_own_heights_ = false;
    SmoothCurve heights_;  // z: height of the eye, or its offset from the track's heights
    std::optional<WorldPos> target_world_;
    SmoothCurve forward_;
    SmoothCurve up_;
    SmoothCurve turn_;
    std::vector<TrackPoint> orientations_;  // points of a track with orientations
};

/// Names of the built-in paths: see CameraPath.
std::span<const std::string_view> built_in_names();

/// Where to plan a path: see CameraPathSettings.
struct PlanPlace {
    WorldRect region;
    std::optional<WorldVec2> start_world;
    std::optional<GroundLimits> limits;  ///< absent: any ground
};

/// The legs of a built-in path in order of time; the camera jumps between two legs. A pure function of the arguments.
///
/// @param name     one of built_in_names()
/// @param place    where to plan the path
/// @param speed    horizontal, m/s, > 0
/// @param duration of all legs together, seconds, > 0
///
/// Fails: io if the terrain cannot be read
Result<std::vector<LegPlan>> plan_built_in(std::string_view name, const HeightSource& source,
                                           const PlanPlace& place, double speed, double duration);

}  // namespace terrane::internal
