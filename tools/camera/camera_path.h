// SPDX-License-Identifier: MIT
#pragma once

#include "camera/camera_leg.h"

#include <terrane/terrain/height_source.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

struct CameraPathSettings {
    /// Metres a second over the plane, > 0. Absent: a track's own times, or one of the defaults.
    std::optional<double> speed = std::nullopt;
    /// Metres above the ground, > 0, kept smooth: see CameraPath. Absent: a track's own heights, or
    /// kDefaultAltitude.
    std::optional<double> altitude = std::nullopt;
    double start = 0.0;  ///< seconds of a track that are left out at its beginning, >= 0
    std::optional<double> seconds =
        std::nullopt;  ///< > 0; absent: all of a track, or kDefaultSeconds

    static constexpr double kDefaultSpeed = 100.0;
    static constexpr double kDefaultSpinSpeed = 20.0;  // of `spins`
    static constexpr double kDefaultAltitude = 200.0;
    static constexpr double kDefaultSeconds = 20.0;
};

/// The way of a camera through time: a pure function of the terrain, the settings and the track.
///
///   straight   along the middle of the terrain's longer side
///   orbit      around the middle, looking at it; one turn where there is room for it
///   canyon     along the valleys of the terrain's roughest part, leaning into the turns
///   turns      there and back over the middle, with half a circle of 6 s at each end
///   spins      straight, while the view turns around the vertical at 90 degrees a second, with
///              rests and reversals
///   teleports  straight for 5 s each time, then elsewhere with another heading
///
/// A built-in path that is longer than the terrain goes on straight beyond it. A camera at an
/// altitude flies that high above the smoothed ground, higher where a ridge would come closer than
/// half the altitude. A recorded track that comes closer to the ground than 2 m is lifted there; the
/// heights of other tracks are taken as they are.
class CameraPath {
public:
    /// Whether a name is one of the built-in paths.
    static bool is_built_in(const std::string& name);
    /// Their names, as a person would list them: "straight, orbit".
    static std::string built_in_list();
    static std::vector<std::string> built_in_names();

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
    /// The pose at a time from 0 to duration(); at the moment of a jump, where it leads to.
    CameraPose at(double time) const;
    /// The same but for moments of jumps: where a jump begins.
    CameraPose before(double time) const;
    /// When the camera jumps: seconds between 0 and duration(), rising.
    std::span<const double> jumps() const { return jumps_; }

private:
    CameraPath() = default;

    double duration_ = 0.0;
    std::vector<CameraLeg> legs_;  // one more than jumps
    std::vector<double> jumps_;
};

}  // namespace terrane::tools
