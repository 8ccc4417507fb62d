// SPDX-License-Identifier: MIT
#include "source/cell_deviation.h"

namespace terrane::internal {

FindMaxDeviations find_max_deviations(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return kFindMaxDeviationsAvx512;
    if (level == SimdLevel::avx2) return kFindMaxDeviationsAvx2;
#else
    static_cast<void>(level);
#endif
    return kFindMaxDeviationsBaseline;
}

}  // namespace terrane::internal
