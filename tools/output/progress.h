// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace terrane::tools {

/// One line on standard error that says how far a long command is and how long it will still take; nothing at all
/// where standard error is no terminal, or the command takes less than a third of a second. A thread keeps the line
/// up to date, also while the command waits for something. The line is wiped when the object goes; let one live at a
/// time.
class Progress {
public:
    /// @param what the command does: "flying"
    explicit Progress(std::string what);
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress();

    /// Tells which share of the work is done, 0 to 1. Costs next to nothing. The time that is left is taken from the
    /// speed since the first call.
    void show(double share);

private:
    void keep_drawn();

    std::string what_;
    std::chrono::steady_clock::time_point created_;
    std::atomic<double> share_{-1.0};  // below 0: not known
    std::atomic<double> first_share_{0.0};
    std::atomic<std::chrono::steady_clock::time_point> first_shown_{};
    std::mutex mutex_;
    std::condition_variable ends_;
    bool is_over_ = false;
    std::thread thread_;  // only where there is a terminal
};

/// The line of a moment: "flying: 42 %, 1 min 20 s left".
///
/// @param share       done, 0 to 1; below 0 where it is not known: then the time that has passed is told
/// @param elapsed     seconds since the beginning
/// @param first_share done when the share was first known, `since_first` seconds ago
std::string format_progress(const std::string& what, double share, double elapsed,
                            double first_share, double since_first);

}  // namespace terrane::tools
