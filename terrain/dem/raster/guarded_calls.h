// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <thread>

namespace terrane::internal {

/// Runs calls with a timeout, one at a time, on a thread of its own: reading a file can block for ever (a pipe, a dead
/// network mount) or loop for ever (a damaged file), and neither can be interrupted from outside.
///
/// A call that timed out continues on a detached thread, so it must own all that it uses. From then on the process ends
/// without running destructors of static objects, because that thread may still use them; standard streams are
/// flushed, and the exit status is kept.
class GuardedCalls {
public:
    /// @param patience_s  longest time for one call, seconds; infinity: no limit
    explicit GuardedCalls(double patience_s);
    /// Waits for the call in progress, unless it timed out.
    ~GuardedCalls();
    GuardedCalls(const GuardedCalls&) = delete;
    GuardedCalls& operator=(const GuardedCalls&) = delete;

    /// Runs a call and waits for its end; rethrows its exceptions. Returns false if it, or one before it, timed out.
    ///
    /// Threads: any; waiting for other calls does not count towards the timeout
    bool run(std::function<void()> call);

    double patience_s() const { return patience_s_; }

private:
    struct Shared;

    double patience_s_;
    std::mutex turn_;
    std::shared_ptr<Shared> shared_;
    std::thread thread_;
};

}  // namespace terrane::internal
