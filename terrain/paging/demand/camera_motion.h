// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/predicted_view.h"

#include <terrane/terrain/pager.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Motion is looked at so often, seconds.
inline constexpr double kTick_s = 0.05;

/// Follows one camera and foresees where it will be.
///
/// What it remembers goes by the clock, not by how often it is asked: views count where the clock has
/// passed another tick.
class CameraMotion {
public:
    /// Takes in where the camera is now. A jump, of the place or the look, begins anew.
    ///
    /// @return whether it has jumped
    bool observe(const CameraNeed& camera, double time_s);

    /// What the camera will see. It goes on with the speed, acceleration and turning of its last
    /// fraction of a second, or along its way where that is known. A turn is trusted for as long as it
    /// has lasted; doubt grows with how wrong this has been before.
    Outlook foresee(const CameraNeed& camera, double time_s, double horizon) const;

    /// Everything that another camera's place in the list knew is forgotten.
    void forget() { *this = {}; }

private:
    struct Place {
        double time_s = 0.0;
        Eigen::Vector3d eye_world = Eigen::Vector3d::Zero();
        Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
        Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
        Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    };
    /// What was foreseen for a moment that has not come yet.
    struct Guess {
        double time_s = 0.0;
        Eigen::Vector3d eye_world;
        Eigen::Vector3d forward;
    };

    bool is_jump(const Place& now) const;
    void measure(const Place& now);
    void judge(const Place& now);
    /// Takes a place on by a step along a straight line or a bend.
    void advance(Place& place, double step_s) const;
    void foresee_motion(const CameraNeed& camera, double horizon, Outlook& outlook) const;

    static constexpr std::size_t kPlaces = 5;  // a fifth of a second
    std::array<Place, kPlaces> places_;        // the newest first
    std::size_t place_count_ = 0;
    std::vector<Guess> guesses_;  // the oldest first
    std::int64_t tick_ = 0;

    Place now_;
    Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  // of the look, radians a second
    Eigen::Vector3d bend_ = Eigen::Vector3d::Zero();  // of the way, radians a second
    double speed_gain_ = 0.0;                         // metres a second squared
    double steady_s_ = 0.0;                           // how long the turning has been what it is
    double turn_error_ = 0.0;                         // radians a second
    double place_error_ = 0.0;                        // metres a second squared
};

}  // namespace terrane::internal
