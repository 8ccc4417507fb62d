// SPDX-License-Identifier: MIT
#include "machine.h"

#include <algorithm>
#include <ctime>
#include <fstream>
#include <thread>

namespace terrane::bench {

std::string describe_machine() {
    std::string model = "unknown processor";
    std::ifstream cpus("/proc/cpuinfo");
    for (std::string line; std::getline(cpus, line);) {
        if (line.rfind("model name", 0) != 0) continue;
        model = line.substr(line.find(':') + 2);
        break;
    }
    std::string load = "unknown";
    std::ifstream("/proc/loadavg") >> load;
#ifdef __clang__
    const std::string compiler = "clang " __clang_version__;
#else
    const std::string compiler = "g++ " __VERSION__;
#endif
#ifdef NDEBUG
    const std::string build = "NDEBUG";
#else
    const std::string build = "with asserts of the standard library";
#endif
    return model + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads, load " +
           load + "; " + compiler + ", " + build;
}

double Stopwatch::now() const {
    timespec time{};
    clock_gettime(clock_ == Clock::wall ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

double median(std::vector<double> values) {
    std::nth_element(values.begin(),
                     values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

}  // namespace terrane::bench
