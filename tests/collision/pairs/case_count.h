// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>

namespace terrane::test {

/// How many random cases: more where TERRANE_CASE_FACTOR says so, as the tests under `long` do.
inline int case_count(int usual) {
    const char* factor = std::getenv("TERRANE_CASE_FACTOR");
    return factor == nullptr ? usual : usual * std::atoi(factor);
}

}  // namespace terrane::test
