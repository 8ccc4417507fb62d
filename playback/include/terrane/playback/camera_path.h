// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/playback/track.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane {

/// Pose and velocity of a camera at one time.
struct CameraPose {
    WorldPos eye_world = WorldPos::Zero();               ///< metres
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit, perpendicular to forward
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second
};

/// Settings of CameraPath::create().
struct CameraPathSettings {
    /// Speed, m/s, > 0: horizontal, or along a track with heights. Absent: the track's own times, or the default.
    std::optional<double> speed = std::nullopt;
    /// Metres above the smoothed ground, > 0: see CameraPath. Absent: the track's own heights, or kDefaultAltitude.
    std::optional<double> altitude = std::nullopt;
    double start = 0.0;  ///< seconds skipped at the start of a track, >= 0
    std::optional<double> seconds =
        std::nullopt;  ///< duration, > 0; absent: the whole track, or kDefaultSeconds
    /// Part of the terrain in which a built-in path is planned, metres; its sides are finite and above 0. Absent: the
    /// source's extent.
    std::optional<WorldRect> region = std::nullopt;
    /// Start of `straight`, `orbit`, `turns` and `spins`, metres, finite. Absent: `straight`, `spins` and the first
    /// straight of `turns` are centred on the region, and `orbit` circles its centre.
    std::optional<WorldVec2> start_world = std::nullopt;
    /// Steepest ground that a built-in path may cross, rise over run, > 0: see CameraPath. Absent: any ground.
    std::optional<double> max_slope = std::nullopt;
    /// Used if a max_slope is set: how far the ground may be above or below the mean of the ground `bump_reach` to both
    /// sides, metres, > 0: what a vehicle clears between its axles. Infinite: any bump.
    double max_bump = std::numeric_limits<double>::infinity();
    double bump_reach =
        1.5;  ///< metres, > 0 and finite: half the distance of a vehicle's outer axles

    static constexpr double kDefaultSpeed = 100.0;  ///< of built-in paths and tracks without times
    static constexpr double kDefaultSpinSpeed = 20.0;  ///< of `spins`
    static constexpr double kDefaultAltitude = 200.0;  ///< also of tracks without heights
    static constexpr double kDefaultSeconds = 20.0;    ///< of built-in paths
    static constexpr double kMostSeconds = 1e7;        ///< longest duration
};

/// The trajectory of a camera: a pure function of the terrain, the settings and the track.
///
///   straight   through the region's centre, parallel to its longer side
///   orbit      around the centre, looking at it; the radius is such that the path makes one turn, but at least 10 m
///              and at most 0.3 times the region's shorter side
///   canyon     along the valleys of the region's roughest part, banking in turns
///   turns      back and forth over the centre, with a half circle of 6 s at each end
///   spins      straight; the view rotates about the vertical at 90 degrees a second, rests and reverses
///   teleports  straight legs of 5 s, each in another place with another heading
///
/// If a `max_slope` is set, `straight`, `orbit`, `canyon`, `turns` and `spins` are laid over ground that can be
/// climbed, for vehicles and characters. A path that crosses steeper ground or higher bumps is moved and turned as a
/// whole, by up to three times its length, or by up to 40 m from a start_world, and follows the cheapest route near
/// that line; a `canyon` takes another section of the valleys there. Where all ground is steeper, it is as little too
/// steep as possible.
///
/// A built-in path longer than the region continues straight beyond it. If an altitude is set, the camera flies that
/// high above the smoothed ground, and higher where it would be less than half the altitude above the ground. Otherwise
/// a recorded track is raised to a clearance of 2 m, and the heights of other tracks are used as they are.
///
/// A track is followed along a smooth curve through its points, whose velocity is continuous. Whatever the intervals of
/// the points, compared with uniform motion along the straight line between two points, the curve is off by up to 0.53
/// times the distance of the points, and by at most 1.5 s of that motion; its speed is at most 2.5 times the uniform
/// one; the track's own heights stay between the heights of the two points. A recorded track is smoothed before, by its
/// times, or by its length if it has none; its ends keep their places. It is then off by at most 2.3 s of the fastest
/// motion in the 6 s before and after, and at most 2.5 times as fast; without times, it stays within 7.7 m of the
/// straight lines between its points. If a speed is set, times follow from the smoothed positions.
///
/// Immutable, cheap to copy. Threads: any number
class CameraPath {
public:
    /// Whether a name is one of the built-in paths.
    static bool is_built_in(const std::string& name);
    /// The names of the built-in paths in one text, such as "straight, orbit".
    static std::string built_in_list();
    /// The names of the built-in paths, in the order of built_in_list().
    static std::vector<std::string> built_in_names();

    /// Plans a built-in path.
    ///
    /// Fails: invalid_argument for a name that is not a built-in path, and for settings out of range; io if the terrain
    ///        cannot be read
    static Result<CameraPath> create(const std::string& built_in, const HeightSource& source,
                                     const CameraPathSettings& settings);

    /// Follows a track.
    ///
    /// Fails: invalid_argument as track.validate(), for settings out of range, for a start that is not before the
    ///        track's end, and for a track without times whose points all coincide
    static Result<CameraPath> create(Track track, const HeightSource& source,
                                     const CameraPathSettings& settings);

    /// Duration of the whole path, seconds.
    double duration() const;
    /// The pose at a time, 0 to duration(); at the time of a jump, the pose after it.
    CameraPose at(double time) const;
    /// As at(), but at the time of a jump, the pose before it.
    CameraPose before(double time) const;
    /// Times of the jumps, seconds, increasing, between 0 and duration().
    std::span<const double> jumps() const;

private:
    struct Legs;
    explicit CameraPath(std::shared_ptr<const Legs> legs);
    std::shared_ptr<const Legs> legs_;
};

/// Whether there is ground under a point of a path: inside the extent, edges included, and not in a cell that is
/// `cell_outside`.
///
/// Fails: io if the source cannot be read
Result<bool> is_over_ground(const HeightSource& source, double x, double y);

/// One sample of a path.
struct PathMoment {
    double time = 0.0;            ///< seconds
    bool is_before_jump = false;  ///< before a jump; the next sample is after it
    CameraPose pose;              ///< at that time
};

/// Samples of a path from start to end, 50 ms apart; each jump adds two samples of the same time.
std::vector<PathMoment> path_moments(const CameraPath& path);

/// The part of a trajectory that a pager reads at `time_s`: from the last sample at or before `time_s` to the first one
/// beyond the horizon.
///
/// @param moments times must not decrease
template <class Moment>
std::span<const Moment> trajectory_ahead(std::span<const Moment> moments, double time_s,
                                         double horizon) {
    const auto is_later = [](double time, const Moment& moment) { return time < moment.time_s; };
    const auto next = std::upper_bound(moments.begin(), moments.end(), time_s, is_later);
    const auto first = next == moments.begin() ? next : next - 1;
    auto last = std::upper_bound(next, moments.end(), time_s + horizon, is_later);
    if (last != moments.end()) ++last;
    return {first, last};
}

/// Converts a path to CameraNeed::trajectory.
///
/// @param clock the pager's time at the start of the path, seconds
std::vector<CameraMoment> camera_trajectory(std::span<const PathMoment> path, double clock);

}  // namespace terrane
