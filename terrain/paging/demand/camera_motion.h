// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/need.h"

#include <terrane/terrain/pager.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Interval between motion samples, and between plans, seconds.
inline constexpr double kTick_s = 0.05;

/// Tracks the motion of one camera and predicts its view.
///
/// Takes one sample per tick of the clock, so that predictions do not depend on the update rate.
class CameraMotion {
public:
    /// Records the camera's current state. A discontinuity of position or view direction resets the estimate.
    ///
    /// @return whether there was a discontinuity
    bool observe(const CameraNeed& camera, double time_s);

    /// Predicts the view: along the camera's trajectory if it has one, else extrapolated with the speed, acceleration
    /// and turn rates of the last quarter of a second. A turn is trusted for about as long as it has lasted; the
    /// direction margin grows with the recent prediction errors.
    PredictedView predict(const CameraNeed& camera, double time_s, double horizon) const;

    /// Discards all history, for a different camera.
    void reset() { *this = {}; }

private:
    struct CameraSample {
        double time_s = 0.0;
        Eigen::Vector3d eye_world = Eigen::Vector3d::Zero();
        Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
        Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
        Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    };
    /// A pending prediction of a future state.
    struct Prediction {
        double time_s = 0.0;
        Eigen::Vector3d eye_world;
        Eigen::Vector3d forward;
    };

    bool is_jump(const CameraSample& now) const;
    void estimate_motion(const CameraSample& now);
    void measure_prediction_error(const CameraSample& now);
    /// Integrates the estimated motion over one step.
    void advance(CameraSample& sample, double step_s) const;
    void extrapolate(const CameraNeed& camera, double horizon, PredictedView& predicted) const;

    static constexpr std::size_t kHistory = 5;    // ticks: a quarter of a second
    std::array<CameraSample, kHistory> history_;  // newest first
    std::size_t history_count_ = 0;
    std::vector<Prediction> predictions_;  // oldest first
    std::int64_t tick_ = 0;

    CameraSample now_;
    Eigen::Vector3d view_turn_rate_ = Eigen::Vector3d::Zero();  // of the view direction, rad/s
    Eigen::Vector3d path_turn_rate_ = Eigen::Vector3d::Zero();  // of the velocity, rad/s
    double acceleration_ = 0.0;                                 // along the velocity, m/s^2
    double steady_s_ = 0.0;        // time for which the turn rates have been constant
    double turn_error_ = 0.0;      // recent error of predicted view directions, rad/s
    double position_error_ = 0.0;  // recent error of predicted positions, m/s^2
};

}  // namespace terrane::internal
