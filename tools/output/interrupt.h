// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace terrane::tools {

/// From now on the first SIGINT (Ctrl-C), SIGTERM or SIGHUP only sets what is_interrupted() tells, so that a
/// command can finish the files that it has begun. The second one removes the files that RemovedIfKilled names
/// and ends the program at once, with exit code 1. Where SIGHUP is ignored (nohup), it stays so. Before the call,
/// and in commands that never make it, each of the signals ends the program as usual.
///
/// Threads: any; calls after the first change nothing.
void watch_for_interrupts();

/// Whether a signal has come since watch_for_interrupts(). Threads: any. Cost: one atomic load.
bool is_interrupted();

/// Names a file that a second signal removes, as long as the object lives. At most 16 at once are remembered;
/// of more, those beyond stay where the program is killed.
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
