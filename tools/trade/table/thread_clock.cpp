// SPDX-License-Identifier: MIT
#include "trade/table/thread_clock.h"

#include <ctime>

namespace terrane::tools {

double thread_seconds() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace terrane::tools
