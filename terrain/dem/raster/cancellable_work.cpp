// SPDX-License-Identifier: MIT
#include "raster/cancellable_work.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kShortestSlice = 1e-3, kLongestSlice = 0.5;  ///< seconds

void end_at_once(int status, void* /*unused*/) {
    std::fflush(nullptr);
    _exit(status);
}

/// Exit handlers run in reverse order of registration, so this one runs before the destructors of all static objects
/// that exist by now.
void skip_static_destructors() {
    static const int registered = on_exit(end_at_once, nullptr);
    static_cast<void>(registered);
}

}  // namespace

struct GuardedCalls::Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::function<void()> call;  ///< empty: no call in progress
    std::exception_ptr thrown;
    bool given_up = false, stop = false;

    void serve() {
        std::unique_lock lock(mutex);
        while (true) {
            changed.wait(lock, [this] { return stop || call; });
            if (!call) return;
            lock.unlock();
            std::exception_ptr caught;
            try {
                call();
            } catch (...) {
                caught = std::current_exception();
            }
            lock.lock();
            thrown = std::move(caught);
            call = nullptr;
            changed.notify_all();
        }
    }
};

GuardedCalls::GuardedCalls(double patience_s)
    : patience_s_(patience_s), shared_(std::make_shared<Shared>()) {
    thread_ = std::thread([shared = shared_] { shared->serve(); });
}

GuardedCalls::~GuardedCalls() {
    bool given_up = false;
    {
        const std::lock_guard lock(shared_->mutex);
        shared_->stop = true;
        given_up = shared_->given_up;
    }
    shared_->changed.notify_all();
    if (given_up) {
        thread_.detach();
    } else {
        thread_.join();
    }
}

bool GuardedCalls::run(std::function<void()> call) {
    const std::lock_guard turn(turn_);
    std::unique_lock lock(shared_->mutex);
    if (shared_->given_up) return false;
    shared_->call = std::move(call);
    shared_->changed.notify_all();
    const auto is_done = [this] { return !shared_->call; };
    // Waits in short slices of nominal length, so that time in which the process is stopped does not count.
    const double slice_s = std::clamp(patience_s_ / 8.0, kShortestSlice, kLongestSlice);
    for (double waited_s = 0.0; waited_s < patience_s_; waited_s += slice_s) {
        if (shared_->changed.wait_for(lock, std::chrono::duration<double>(slice_s), is_done)) break;
    }
    if (!is_done()) {
        shared_->given_up = true;
        skip_static_destructors();
        return false;
    }
    if (shared_->thrown) std::rethrow_exception(std::exchange(shared_->thrown, nullptr));
    return true;
}

void OpeningProgress::begin(double end, std::int64_t steps) {
    const std::lock_guard lock(mutex_);
    from_ = to_;
    to_ = end;
    done_ = 0;
    steps_ = std::max<std::int64_t>(steps, 1);
}

Result<void> OpeningProgress::step() {
    const std::lock_guard lock(mutex_);
    done_ = std::min(done_ + 1, steps_);
    if (report_ && !cancelled_) {
        const double share = static_cast<double>(done_) / static_cast<double>(steps_);
        cancelled_ = !report_(from_ + (to_ - from_) * share);
    }
    if (cancelled_) {
        return fail(ErrorCode::cancelled, "opening raster \"" + path_ + "\" was cancelled");
    }
    return {};
}

}  // namespace terrane::internal
