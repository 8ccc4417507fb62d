// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>

namespace terrane::test {

/// Number of random cases, times TERRANE_CASE_FACTOR, which the tests labelled long set.
inline int case_count(int usual) {
    const char* factor = std::getenv("TERRANE_CASE_FACTOR");
    return factor == nullptr ? usual : usual * std::atoi(factor);
}

}  // namespace terrane::test
