// SPDX-License-Identifier: MIT
//
// Sources:
//   X. R. Li, V. Jilkov. A survey of maneuvering target tracking, part I: dynamic models. IEEE
//   Transactions on Aerospace and Electronic Systems 39(4), 2003. (constant turn rate and acceleration)
// Deviations: no filter, because camera states are free of noise. Confidence in the model is measured by the error of
// its predictions half a second ahead.
#include "paging/demand/camera_motion.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kPredictionAhead_s = 0.5;
// Decay of prediction errors per tick: to a third in two seconds.
constexpr double kErrorDecay = 0.973;
// Sine of the rotation between two ticks above which the motion is discontinuous.
constexpr double kLargestTurn = 0.87;
// Seconds for which the acceleration is extrapolated.
constexpr double kAcceleration_s = 1.5;
// A turn is trusted up to this angle, radians, or else for this time, seconds, plus the time that it has already
// lasted.
constexpr double kSmallTurn = 0.3;
constexpr double kFirstTrust_s = 0.5;
// Sine of the direction margin just after the present, and time after which nothing is speculation, seconds.
constexpr double kDirectionMargin = 0.17;
constexpr double kSpeculation_s = 1.0;
// Expected prediction error above which a state is speculation: angle, radians, and share of the distance travelled.
constexpr double kTrustedError = 0.35;
constexpr double kTrustedShare = 0.3;
// Time constant of the decay of predicted vertical speed, seconds: cameras near the ground tend to follow the ground.
constexpr double kClimb_s = 1.0;
// Interval between two predicted states, seconds: kGapShare of the time ahead, at least kFirstGap_s; shorter in turns.
constexpr double kFirstGap_s = 0.1;
constexpr double kGapShare = 0.2;
constexpr double kLargestGapTurn = 0.4;
constexpr std::size_t kMostStates = 40;

Eigen::Vector3d right_of(const Eigen::Vector3d& forward, const Eigen::Vector3d& up) {
    return forward.cross(up);
}

// Rotates a vector by a small angle (second order), keeping its length.
Eigen::Vector3d rotated(const Eigen::Vector3d& vector, const Eigen::Vector3d& angle) {
    const Eigen::Vector3d once = angle.cross(vector);
    const Eigen::Vector3d result = vector + once + 0.5 * angle.cross(once);
    const double length = result.norm();
    return length > 0.0 ? Eigen::Vector3d(result * (vector.norm() / length)) : vector;
}

// Collects states at the intervals above.
class StateSampler {
public:
    StateSampler(const View& view, PredictedView& predicted) : view_(view), predicted_(predicted) {}

    void add(const PredictedView::CameraState& state, const Eigen::Vector3d& forward,
             const Eigen::Vector3d& up, bool must) {
        if (!must && !predicted_.states.empty()) {
            const double gap = state.time_s - predicted_.states.back().time_s;
            const bool has_turned = forward.cross(last_forward_).norm() > kLargestGapTurn ||
                                    forward.dot(last_forward_) < 0.0;
            const bool is_due =
                gap >= std::max(kFirstGap_s, kGapShare * state.time_s) - 1e-9 || has_turned;
            if (!is_due || predicted_.states.size() >= kMostStates) return;
        }
        predicted_.states.push_back(state);
        View view = view_;
        view.forward = forward;
        view.up = up;
        predicted_.states.back().frustum = make_frustum(view);
        last_forward_ = forward;
    }

private:
    const View& view_;
    PredictedView& predicted_;
    Eigen::Vector3d last_forward_ = Eigen::Vector3d::Zero();
};

void predict_trajectory(const CameraNeed& camera, double time_s, double horizon,
                        PredictedView& predicted) {
    StateSampler sampler(camera.view, predicted);
    sampler.add({.time_s = 0.0, .eye_world = camera.view.eye_world}, camera.view.forward,
                camera.view.up, true);
    CameraMoment last{time_s, camera.view.eye_world, camera.view.forward, camera.view.up};
    for (const CameraMoment& next : camera.trajectory) {
        if (!(next.time_s >= last.time_s)) continue;
        const double length = next.time_s - last.time_s;
        if (!(length > 0.0) && next.time_s <= time_s) {
            continue;  // a jump in the past
        }
        const bool is_jump = !(length > 0.0);
        const int steps =
            is_jump ? 1 : std::clamp(static_cast<int>(std::ceil(length / kTick_s)), 1, 64);
        for (int i = 1; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            const double at_s = last.time_s + t * length - time_s;
            if (at_s > horizon) return;
            const Eigen::Vector3d eye = last.eye_world + t * (next.eye_world - last.eye_world);
            const Eigen::Vector3d mean = last.forward + t * (next.forward - last.forward);
            const Eigen::Vector3d forward = mean.norm() > 1e-6 ? mean.normalized() : next.forward;
            Eigen::Vector3d up = last.up + t * (next.up - last.up);
            up -= up.dot(forward) * forward;
            up = up.norm() > 1e-6 ? up.normalized() : next.up;
            // the state after a jump is always added
            sampler.add({.time_s = at_s, .eye_world = eye, .is_jump = is_jump}, forward, up,
                        is_jump);
        }
        last = next;
    }
}

}  // namespace

bool CameraMotion::is_jump(const CameraSample& now) const {
    const CameraSample& before = history_[0];
    const double passed = now.time_s - before.time_s;
    const double speed = std::max(now.velocity.norm(), before.velocity.norm());
    const double distance = (now.eye_world - before.eye_world).norm();
    constexpr double kFewMetres = 20.0;
    return distance > 3.0 * speed * passed + kFewMetres ||
           now.forward.cross(before.forward).norm() > kLargestTurn ||
           now.forward.dot(before.forward) < 0.0;
}

// Estimates turn rates and acceleration from the history.
void CameraMotion::estimate_motion(const CameraSample& now) {
    const CameraSample& then = history_[history_count_ - 1];
    const double passed = now.time_s - then.time_s;
    if (!(passed > 0.0)) return;
    Eigen::Vector3d view_turn_rate = Eigen::Vector3d::Zero();
    Eigen::Vector3d path_turn_rate = Eigen::Vector3d::Zero();
    // rotations between neighbouring samples are summed, so that fast turns are not underestimated
    const CameraSample* newer = &now;
    for (std::size_t i = 0; i < history_count_; ++i) {
        const CameraSample& older = history_[i];
        view_turn_rate +=
            0.5 * (older.forward.cross(newer->forward) + older.up.cross(newer->up) +
                   right_of(older.forward, older.up).cross(right_of(newer->forward, newer->up)));
        const double square = older.velocity.norm() * newer->velocity.norm();
        if (square > 0.01) path_turn_rate += older.velocity.cross(newer->velocity) / square;
        newer = &older;
    }
    view_turn_rate /= passed;
    path_turn_rate /= passed;
    const double changed =
        (view_turn_rate - view_turn_rate_).norm() + (path_turn_rate - path_turn_rate_).norm();
    const double level = 0.3 * (view_turn_rate.norm() + path_turn_rate.norm()) + 0.05;
    steady_s_ = changed > level ? 0.0 : steady_s_ + (now.time_s - history_[0].time_s);
    view_turn_rate_ = view_turn_rate;
    path_turn_rate_ = path_turn_rate;
    acceleration_ = (now.velocity.norm() - then.velocity.norm()) / passed;
}

// Compares past predictions with the current state.
void CameraMotion::measure_prediction_error(const CameraSample& now) {
    turn_error_ *= kErrorDecay;
    position_error_ *= kErrorDecay;
    while (!predictions_.empty() && predictions_.front().time_s <= now.time_s + 1e-9) {
        const Prediction& prediction = predictions_.front();
        if (now.time_s - prediction.time_s < kTick_s) {
            const double sine = prediction.forward.dot(now.forward) > 0.0
                                    ? prediction.forward.cross(now.forward).norm()
                                    : 1.0;
            turn_error_ = std::max(turn_error_, sine / kPredictionAhead_s);
            const double away = (prediction.eye_world - now.eye_world).norm();
            position_error_ =
                std::max(position_error_, 2.0 * away / (kPredictionAhead_s * kPredictionAhead_s));
        }
        predictions_.erase(predictions_.begin());
    }
}

void CameraMotion::advance(CameraSample& sample, double step_s) const {
    const double speed = sample.velocity.norm();
    const Eigen::Vector3d before = sample.velocity;
    const bool is_accelerating = sample.time_s - now_.time_s < kAcceleration_s;
    const double gained = std::max(0.0, speed + (is_accelerating ? acceleration_ * step_s : 0.0));
    sample.velocity = rotated(before, step_s * path_turn_rate_);
    if (speed > 0.0) sample.velocity *= gained / speed;
    sample.velocity.z() *= std::max(0.0, 1.0 - step_s / kClimb_s);
    sample.eye_world += 0.5 * step_s * (before + sample.velocity);
    sample.forward = rotated(sample.forward, step_s * view_turn_rate_);
    sample.up = rotated(sample.up, step_s * view_turn_rate_);
    sample.up -= sample.up.dot(sample.forward) * sample.forward;
    sample.up.normalize();
    sample.time_s += step_s;
}

bool CameraMotion::observe(const CameraNeed& camera, double time_s) {
    const CameraSample now{time_s, camera.view.eye_world, camera.velocity, camera.view.forward,
                           camera.view.up};
    now_ = now;
    const auto tick = static_cast<std::int64_t>(std::clamp(time_s / kTick_s + 1e-6, -1e15, 1e15));
    const bool has_jumped = history_count_ > 0 && is_jump(now);
    if (history_count_ > 0 && tick == tick_ && !has_jumped) return false;
    tick_ = tick;
    if (has_jumped) {
        reset();
        now_ = now;
        tick_ = tick;
    }
    if (history_count_ > 0) estimate_motion(now);
    measure_prediction_error(now);
    std::copy_backward(history_.begin(), history_.end() - 1, history_.end());
    history_[0] = now;
    history_count_ = std::min(history_count_ + 1, kHistory);

    CameraSample ahead = now;
    for (int i = 0; i < 5; ++i) advance(ahead, kPredictionAhead_s / 5);
    predictions_.push_back({now.time_s + kPredictionAhead_s, ahead.eye_world, ahead.forward});
    return has_jumped;
}

void CameraMotion::extrapolate(const CameraNeed& camera, double horizon,
                               PredictedView& predicted) const {
    StateSampler sampler(camera.view, predicted);
    CameraSample sample = now_;
    const double turn_rate = view_turn_rate_.norm() + path_turn_rate_.norm();
    const double speed = now_.velocity.norm();
    double time_s = 0.0;
    for (;;) {
        const bool is_turning_on =
            turn_rate * time_s > kSmallTurn && time_s > kFirstTrust_s + steady_s_;
        PredictedView::CameraState state{.time_s = time_s, .eye_world = sample.eye_world};
        // at present the camera may turn in any direction
        state.direction_margin = time_s <= 0.0 ? 1.0
                                 : time_s <= kSpeculation_s
                                     ? std::min(1.0, kDirectionMargin + turn_error_ * time_s)
                                     : 0.0;
        state.is_trusted = !is_turning_on && turn_error_ * time_s <= kTrustedError &&
                           0.5 * position_error_ * time_s <= kTrustedShare * speed;
        if (!state.is_trusted && time_s > kSpeculation_s) return;
        sampler.add(state, sample.forward, sample.up, false);
        if (time_s >= horizon) return;
        const double step_s = std::min(kTick_s, horizon - time_s);
        advance(sample, step_s);
        time_s = horizon - time_s <= kTick_s ? horizon : time_s + step_s;
    }
}

PredictedView CameraMotion::predict(const CameraNeed& camera, double time_s, double horizon) const {
    PredictedView predicted;
    predicted.states.reserve(kMostStates);
    predicted.distance_per_bound = camera.view.pixels_per_radian() / camera.threshold_px;
    predicted.near_distance = camera.view.near_distance;
    if (camera.trajectory.empty()) {
        extrapolate(camera, horizon, predicted);
    } else {
        predict_trajectory(camera, time_s, horizon, predicted);
    }
    predicted.update_eye_bounds();
    return predicted;
}

}  // namespace terrane::internal
