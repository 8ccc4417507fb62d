// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace terrane::tools {

/// Installs handlers: the first SIGINT (Ctrl-C), SIGTERM or SIGHUP only sets is_interrupted(), so that a command can
/// complete its files. The second one removes the files of all RemovedIfKilled objects and ends the program at once
/// with exit code 1. An ignored SIGHUP (nohup) stays ignored. Without this call the signals end the program as usual.
///
/// Threads: any; calls after the first have no effect.
void watch_for_interrupts();

/// Whether a signal arrived since watch_for_interrupts(). Threads: any. Cost: one atomic load.
bool is_interrupted();

/// Registers a file that a second signal removes, for the lifetime of the object. At most 16 files at once; further
/// ones remain if the program is killed.
class RemovedIfKilled {
public:
    explicit RemovedIfKilled(std::string path);
    RemovedIfKilled(const RemovedIfKilled&) = delete;
    RemovedIfKilled& operator=(const RemovedIfKilled&) = delete;
    ~RemovedIfKilled();

private:
    std::string path_;
    int place_ = -1;
};

/// A progress line on standard error with the completed share and the remaining time. It is not shown if standard error
/// is not a terminal, or during the first 0.3 s. A thread updates the line, even while the command blocks. The
/// destructor clears the line. Only one object may exist at a time.
class Progress {
public:
    /// @param what activity of the command: "flying"
    explicit Progress(std::string what);
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress();

    /// Sets the completed share, 0 to 1. The remaining time is extrapolated from the speed since the first call.
    /// Cost: an atomic store.
    void show(double share);

private:
    void keep_drawn();

    std::string what_;
    std::chrono::steady_clock::time_point created_;
    std::atomic<double> share_{-1.0};  // negative: unknown
    std::atomic<double> first_share_{0.0};
    std::atomic<std::chrono::steady_clock::time_point> first_shown_{};
    std::mutex mutex_;
    std::condition_variable ends_;
    bool is_over_ = false;
    std::thread thread_;  // only on a terminal
};

/// The text of the line: "flying: 42 %, 1 min 20 s left".
///
/// @param share       completed share, 0 to 1; if negative, it is unknown, and the line shows the elapsed time
/// @param elapsed     seconds since the start
/// @param first_share the first known share, which was reached `since_first` seconds ago
std::string format_progress(const std::string& what, double share, double elapsed,
                            double first_share, double since_first);

}  // namespace terrane::tools
