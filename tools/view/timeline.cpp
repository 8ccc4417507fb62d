// SPDX-License-Identifier: MIT
#include "view/timeline.h"

#include <algorithm>
#include <cmath>

namespace terrane::tools {

void Timeline::play() {
    if (time_ >= duration_) time_ = 0.0;
    is_playing_ = true;
}

void Timeline::set_rate(double rate) {
    if (!std::isnan(rate)) rate_ = std::clamp(rate, kLeastRate, kMostRate);
}

void Timeline::seek(double time) {
    if (!std::isnan(time)) time_ = std::clamp(time, first_, last_);
}

void Timeline::set_past(double first, double last) {
    first_ = first;
    last_ = std::max(first, last);
}

void Timeline::step(double seconds) {
    pause();
    seek(time_ + seconds);
}

double Timeline::advance(double seconds) {
    if (!is_playing_ || !(seconds > 0.0)) return 0.0;
    const double wanted = rate_ * seconds;
    if (time_ + wanted < duration_) {
        time_ += wanted;
        return wanted;
    }
    if (loops_ && duration_ > 0.0) {
        time_ = std::fmod(time_ + wanted, duration_);
        return wanted;
    }
    const double left = duration_ - time_;
    time_ = duration_;
    is_playing_ = false;
    return left;
}

}  // namespace terrane::tools
