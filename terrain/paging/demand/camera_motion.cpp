// SPDX-License-Identifier: MIT
//
// Sources:
//   X. R. Li, V. Jilkov. A survey of maneuvering target tracking, part I: dynamic models. IEEE
//   Transactions on Aerospace and Electronic Systems 39(4), 2003. (constant turn rate and acceleration)
// Deviations: no filter: cameras are known exactly. How far the model can be trusted is measured by how
// wrong it was half a second ago.
#include "paging/demand/camera_motion.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kGuessAhead_s = 0.5;
// What a wrong guess counts for after each tick: a third after two seconds.
constexpr double kForget = 0.973;
// A view cannot be followed through a larger turn than this between two ticks (sine).
constexpr double kLargestTurn = 0.87;
// Speed changes are believed for so long.
constexpr double kGain_s = 1.5;
// Turning is trusted through this angle at once, radians, and for this long at first, seconds.
constexpr double kSmallTurn = 0.3;
constexpr double kFirstTrust_s = 0.5;
// Sine of how far a camera may turn in no time; and how far ahead, seconds, what may be is looked at.
constexpr double kDoubt = 0.17;
constexpr double kSpeculation_s = 1.0;
// Angle by which a guess may be off, radians, and share of the way, before it is speculation.
constexpr double kTrustedError = 0.35;
constexpr double kTrustedShare = 0.3;
// Climbing and sinking are followed for about so long: who flies over ground follows it.
constexpr double kClimb_s = 1.0;
// Moments lie closer where the look turns, and at first: a share of the time to them.
constexpr double kFirstGap_s = 0.1;
constexpr double kGapShare = 0.2;
constexpr double kLargestGapTurn = 0.4;
constexpr std::size_t kMostMoments = 40;

Eigen::Vector3d right_of(const Eigen::Vector3d& forward, const Eigen::Vector3d& up) {
    return forward.cross(up);
}

// Turns a vector by a small angle, keeping its length.
Eigen::Vector3d turned(const Eigen::Vector3d& vector, const Eigen::Vector3d& angle) {
    const Eigen::Vector3d once = angle.cross(vector);
    const Eigen::Vector3d result = vector + once + 0.5 * angle.cross(once);
    const double length = result.norm();
    return length > 0.0 ? Eigen::Vector3d(result * (vector.norm() / length)) : vector;
}

// Collects moments, but no more than are of use.
class Moments {
public:
    Moments(const View& view, Outlook& outlook) : view_(view), outlook_(outlook) {}

    void add(const Outlook::Moment& moment, const Eigen::Vector3d& forward,
             const Eigen::Vector3d& up, bool must) {
        if (!must && !outlook_.moments.empty()) {
            const double gap = moment.time_s - outlook_.moments.back().time_s;
            const bool has_turned = forward.cross(last_forward_).norm() > kLargestGapTurn ||
                                    forward.dot(last_forward_) < 0.0;
            const bool is_due =
                gap >= std::max(kFirstGap_s, kGapShare * moment.time_s) - 1e-9 || has_turned;
            if (!is_due || outlook_.moments.size() >= kMostMoments) return;
        }
        outlook_.moments.push_back(moment);
        View view = view_;
        view.forward = forward;
        view.up = up;
        outlook_.moments.back().frustum = make_frustum(view);
        last_forward_ = forward;
    }

private:
    const View& view_;
    Outlook& outlook_;
    Eigen::Vector3d last_forward_ = Eigen::Vector3d::Zero();
};

void predict_trajectory(const CameraNeed& camera, double time_s, double horizon, Outlook& outlook) {
    Moments moments(camera.view, outlook);
    moments.add({.time_s = 0.0, .eye_world = camera.view.eye_world}, camera.view.forward,
                camera.view.up, true);
    CameraMoment last{time_s, camera.view.eye_world, camera.view.forward, camera.view.up};
    for (const CameraMoment& next : camera.trajectory) {
        if (!(next.time_s >= last.time_s)) continue;
        const double length = next.time_s - last.time_s;
        if (!(length > 0.0) && next.time_s <= time_s) {
            // the jump that has led here
            continue;
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
            // the last moment before a jump counts as well
            moments.add({.time_s = at_s, .eye_world = eye, .is_jump = is_jump}, forward, up,
                        is_jump);
        }
        last = next;
    }
}

}  // namespace

bool CameraMotion::is_jump(const Place& now) const {
    const Place& before = places_[0];
    const double passed = now.time_s - before.time_s;
    const double speed = std::max(now.velocity.norm(), before.velocity.norm());
    const double way = (now.eye_world - before.eye_world).norm();
    constexpr double kFewMetres = 20.0;
    return way > 3.0 * speed * passed + kFewMetres ||
           now.forward.cross(before.forward).norm() > kLargestTurn ||
           now.forward.dot(before.forward) < 0.0;
}

// Turning, bending and gain of speed over the places that are remembered.
void CameraMotion::measure(const Place& now) {
    const Place& then = places_[place_count_ - 1];
    const double passed = now.time_s - then.time_s;
    if (!(passed > 0.0)) return;
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    Eigen::Vector3d bend = Eigen::Vector3d::Zero();
    // between neighbours, so that fast turns are not cut short
    const Place* newer = &now;
    for (std::size_t i = 0; i < place_count_; ++i) {
        const Place& older = places_[i];
        turn +=
            0.5 * (older.forward.cross(newer->forward) + older.up.cross(newer->up) +
                   right_of(older.forward, older.up).cross(right_of(newer->forward, newer->up)));
        const double square = older.velocity.norm() * newer->velocity.norm();
        if (square > 0.01) bend += older.velocity.cross(newer->velocity) / square;
        newer = &older;
    }
    turn /= passed;
    bend /= passed;
    const double changed = (turn - turn_).norm() + (bend - bend_).norm();
    const double level = 0.3 * (turn.norm() + bend.norm()) + 0.05;
    steady_s_ = changed > level ? 0.0 : steady_s_ + (now.time_s - places_[0].time_s);
    turn_ = turn;
    bend_ = bend;
    speed_gain_ = (now.velocity.norm() - then.velocity.norm()) / passed;
}

// Compares what was foreseen for now with what came.
void CameraMotion::judge(const Place& now) {
    turn_error_ *= kForget;
    place_error_ *= kForget;
    while (!guesses_.empty() && guesses_.front().time_s <= now.time_s + 1e-9) {
        const Guess& guess = guesses_.front();
        if (now.time_s - guess.time_s < kTick_s) {
            const double sine = guess.forward.dot(now.forward) > 0.0
                                    ? guess.forward.cross(now.forward).norm()
                                    : 1.0;
            turn_error_ = std::max(turn_error_, sine / kGuessAhead_s);
            const double away = (guess.eye_world - now.eye_world).norm();
            place_error_ = std::max(place_error_, 2.0 * away / (kGuessAhead_s * kGuessAhead_s));
        }
        guesses_.erase(guesses_.begin());
    }
}

void CameraMotion::advance(Place& place, double step_s) const {
    const double speed = place.velocity.norm();
    const Eigen::Vector3d before = place.velocity;
    const bool is_gaining = place.time_s - now_.time_s < kGain_s;
    const double gained = std::max(0.0, speed + (is_gaining ? speed_gain_ * step_s : 0.0));
    place.velocity = turned(before, step_s * bend_);
    if (speed > 0.0) place.velocity *= gained / speed;
    place.velocity.z() *= std::max(0.0, 1.0 - step_s / kClimb_s);
    place.eye_world += 0.5 * step_s * (before + place.velocity);
    place.forward = turned(place.forward, step_s * turn_);
    place.up = turned(place.up, step_s * turn_);
    place.up -= place.up.dot(place.forward) * place.forward;
    place.up.normalize();
    place.time_s += step_s;
}

bool CameraMotion::observe(const CameraNeed& camera, double time_s) {
    const Place now{time_s, camera.view.eye_world, camera.velocity, camera.view.forward,
                    camera.view.up};
    now_ = now;
    const auto tick = static_cast<std::int64_t>(std::clamp(time_s / kTick_s + 1e-6, -1e15, 1e15));
    const bool has_jumped = place_count_ > 0 && is_jump(now);
    if (place_count_ > 0 && tick == tick_ && !has_jumped) return false;
    tick_ = tick;
    if (has_jumped) {
        forget();
        now_ = now;
        tick_ = tick;
    }
    if (place_count_ > 0) measure(now);
    judge(now);
    std::copy_backward(places_.begin(), places_.end() - 1, places_.end());
    places_[0] = now;
    place_count_ = std::min(place_count_ + 1, kPlaces);

    Place ahead = now;
    for (int i = 0; i < 5; ++i) advance(ahead, kGuessAhead_s / 5);
    guesses_.push_back({now.time_s + kGuessAhead_s, ahead.eye_world, ahead.forward});
    return has_jumped;
}

void CameraMotion::foresee_motion(const CameraNeed& camera, double horizon,
                                  Outlook& outlook) const {
    Moments moments(camera.view, outlook);
    Place place = now_;
    const double turning = turn_.norm() + bend_.norm();
    const double speed = now_.velocity.norm();
    double time_s = 0.0;
    for (;;) {
        const bool is_bending = turning * time_s > kSmallTurn && time_s > kFirstTrust_s + steady_s_;
        Outlook::Moment moment{.time_s = time_s, .eye_world = place.eye_world};
        // it may look anywhere from here
        moment.doubt = time_s <= 0.0              ? 1.0
                       : time_s <= kSpeculation_s ? std::min(1.0, kDoubt + turn_error_ * time_s)
                                                  : 0.0;
        moment.is_trusted = !is_bending && turn_error_ * time_s <= kTrustedError &&
                            0.5 * place_error_ * time_s <= kTrustedShare * speed;
        if (!moment.is_trusted && time_s > kSpeculation_s) return;
        moments.add(moment, place.forward, place.up, false);
        if (time_s >= horizon) return;
        const double step_s = std::min(kTick_s, horizon - time_s);
        advance(place, step_s);
        time_s = horizon - time_s <= kTick_s ? horizon : time_s + step_s;
    }
}

Outlook CameraMotion::foresee(const CameraNeed& camera, double time_s, double horizon) const {
    Outlook outlook;
    outlook.moments.reserve(kMostMoments);
    outlook.distance_per_bound = camera.view.pixels_per_radian() / camera.threshold_px;
    outlook.near_distance = camera.view.near_distance;
    if (camera.trajectory.empty()) {
        foresee_motion(camera, horizon, outlook);
    } else {
        predict_trajectory(camera, time_s, horizon, outlook);
    }
    outlook.find_eyes();
    return outlook;
}

}  // namespace terrane::internal
