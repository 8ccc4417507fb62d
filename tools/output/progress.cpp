// SPDX-License-Identifier: MIT
#include "output/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace terrane::tools {
namespace {

using Clock = std::chrono::steady_clock;

std::string format_time(double seconds) {
    const auto whole = static_cast<long long>(std::ceil(std::min(seconds, 1e9)));
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

double seconds_since(Clock::time_point then) {
    return std::chrono::duration<double>(Clock::now() - then).count();
}

}  // namespace

Progress::Progress(std::string what) : what_(std::move(what)), created_(Clock::now()) {
    if (isatty(STDERR_FILENO) == 1) thread_ = std::thread([this] { keep_drawn(); });
}

Progress::~Progress() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
    }
    ends_.notify_all();
    thread_.join();
}

void Progress::show(double share) {
    if (share_.load() < 0.0) {
        first_share_ = share;
        first_shown_ = Clock::now();
    }
    share_ = std::clamp(share, 0.0, 1.0);
}

void Progress::keep_drawn() {
    constexpr std::chrono::milliseconds kFirst(300), kBetween(200);
    bool is_drawn = false;
    std::unique_lock lock(mutex_);
    while (!ends_.wait_for(lock, is_drawn ? kBetween : kFirst, [this] { return is_over_; })) {
        const double share = share_;
        const double since_first = share < 0.0 ? 0.0 : seconds_since(first_shown_);
        fmt::print(
            stderr, "\r\x1b[K{}",
            format_progress(what_, share, seconds_since(created_), first_share_, since_first));
        std::fflush(stderr);
        is_drawn = true;
    }
    if (is_drawn) {
        std::fputs("\r\x1b[K", stderr);
        std::fflush(stderr);
    }
}

std::string format_progress(const std::string& what, double share, double elapsed,
                            double first_share, double since_first) {
    if (share < 0.0) return fmt::format("{}: {}", what, format_time(elapsed));
    std::string line = fmt::format("{}: {:.0f} %", what, std::floor(100.0 * share));
    // less gives an unstable estimate
    constexpr double kLeastTime = 0.5, kLeastShare = 0.005;
    const double done = share - first_share;
    if (since_first >= kLeastTime && done >= kLeastShare) {
        line += fmt::format(", {} left", format_time(since_first / done * (1.0 - share)));
    }
    return line;
}

}  // namespace terrane::tools
