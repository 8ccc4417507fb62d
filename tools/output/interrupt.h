// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace terrane::tools {

/// Installs handlers: the first SIGINT (Ctrl-C), SIGTERM or SIGHUP only sets is_interrupted(), so that a command can
/// complete its files. The second one removes the files of all RemovedIfKilled and ends the program at once with exit
/// code 1. An ignored SIGHUP (nohup) stays ignored. Without this call the signals end the program as usual.
///
/// Threads: any; calls after the first have no effect.
void watch_for_interrupts();

/// Whether a signal arrived since watch_for_interrupts(). Threads: any. Cost: one atomic load.
bool is_interrupted();

/// Registers a file that a second signal removes, for the lifetime of the object. At most 16 files at once; others
/// are left behind where the program is killed.
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

}  // namespace terrane::tools
