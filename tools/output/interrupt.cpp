// SPDX-License-Identifier: MIT
#include "output/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <atomic>
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

}  // namespace terrane::tools
