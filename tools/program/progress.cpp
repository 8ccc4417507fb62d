// SPDX-License-Identifier: MIT
#include "program/progress.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <utility>

namespace terrane::tools {
namespace {

std::atomic<bool> interrupted{false};
std::array<std::atomic<const char*>, 16> unfinished_files{};
static_assert(std::atomic<bool>::is_always_lock_free &&
              std::atomic<const char*>::is_always_lock_free);

// Async-signal-safe.
void on_signal(int) {
    if (!interrupted.exchange(true)) return;
    for (const std::atomic<const char*>& file : unfinished_files) {
        if (const char* const path = file.load()) ::unlink(path);
    }
    ::_exit(1);
}

}  // namespace

void watch_for_interrupts() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_RESTART;  // interrupted writes resume
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

bool is_interrupted() { return interrupted.load(std::memory_order_relaxed); }

RemovedIfKilled::RemovedIfKilled(std::string path) : path_(std::move(path)) {
    for (std::size_t i = 0; i < unfinished_files.size(); ++i) {
        const char* none = nullptr;
        if (!unfinished_files[i].compare_exchange_strong(none, path_.c_str())) continue;
        place_ = static_cast<int>(i);
        return;
    }
}

RemovedIfKilled::~RemovedIfKilled() {
    if (place_ >= 0) unfinished_files[static_cast<std::size_t>(place_)].store(nullptr);
}

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
    // below these limits the estimate is unstable
    constexpr double kLeastTime = 0.5, kLeastShare = 0.005;
    const double done = share - first_share;
    if (since_first >= kLeastTime && done >= kLeastShare) {
        line += fmt::format(", {} left", format_time(since_first / done * (1.0 - share)));
    }
    return line;
}

}  // namespace terrane::tools
