// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <string>

namespace terrane::tools {

/// One line on standard error that says how far a long command is; nothing at all where standard
/// error is no terminal. The line is wiped when the object goes.
class Progress {
public:
    explicit Progress(std::string what);
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress();

    /// Shows a share of the way, 0 to 1; at most ten times a second, so call it as often as you like.
    void show(double share);

private:
    std::string what_;
    bool on_terminal_ = false;
    bool shown_ = false;
    std::chrono::steady_clock::time_point last_;
};

}  // namespace terrane::tools
