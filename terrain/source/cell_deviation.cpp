// SPDX-License-Identifier: MIT
#include "source/cell_deviation.h"

namespace terrane::internal {

RaiseDeviations raise_deviations(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return kRaiseDeviationsAvx512;
    if (level == SimdLevel::avx2) return kRaiseDeviationsAvx2;
#else
    static_cast<void>(level);
#endif
    return kRaiseDeviationsBaseline;
}

}  // namespace terrane::internal
