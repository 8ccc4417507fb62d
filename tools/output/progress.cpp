// SPDX-License-Identifier: MIT
#include "output/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace terrane::tools {

Progress::Progress(std::string what)
    : what_(std::move(what)),
      on_terminal_(isatty(STDERR_FILENO) == 1),
      last_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
    if (shown_) std::fputs("\r\x1b[K", stderr);
}

void Progress::show(double share) {
    if (!on_terminal_) return;
    const std::chrono::steady_clock::time_point now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    shown_ = true;
    fmt::print(stderr, "\r\x1b[K{} {:3.0f} %", what_, 100.0 * share);
    std::fflush(stderr);
}

}  // namespace terrane::tools
