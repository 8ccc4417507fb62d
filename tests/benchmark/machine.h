// SPDX-License-Identifier: MIT
#pragma once

#include "lab/measure.h"

#include <fstream>
#include <string>

namespace terrane::bench {

using tools::Clock;
using tools::median;
using tools::Stopwatch;

/// Processor, threads it has, load at the moment, compiler: for the head of a table.
inline std::string describe_machine() {
    const tools::Machine machine = tools::this_machine();
    std::string load = "unknown";
    std::ifstream("/proc/loadavg") >> load;
    return machine.processor + ", " + std::to_string(machine.threads) + " threads, load " + load +
           "; " + machine.compiler + ", " + machine.build;
}

}  // namespace terrane::bench
