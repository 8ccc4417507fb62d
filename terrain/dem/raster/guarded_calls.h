// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <thread>

namespace terrane::internal {

/// Runs calls, one at a time, on a thread of its own, and gives up on one that does not return in
/// time: reading a file can block for ever (a pipe, a dead network mount) or loop for ever (a reader
/// that a damaged file confuses), and neither can be stopped from outside.
///
/// A call that was given up goes on, on a thread that nobody waits for: it must own all that it uses.
/// From then on the process ends without running destructors of static objects, because that thread
/// may still use them; standard streams are flushed, and the exit status is kept.
class GuardedCalls {
public:
    /// @param patience_s  longest time for one call, seconds; infinity: no limit
    explicit GuardedCalls(double patience_s);
    /// Waits for the call in progress, unless it was given up.
    ~GuardedCalls();
    GuardedCalls(const GuardedCalls&) = delete;
    GuardedCalls& operator=(const GuardedCalls&) = delete;

    /// Runs a call and waits for its end; what it throws is thrown here. False where it was given up,
    /// or one before it was.
    ///
    /// Threads: any; calls wait for their turn, which does not count as time
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
