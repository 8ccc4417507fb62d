// SPDX-License-Identifier: MIT
#include "bilinear/triangle_deviation.h"

namespace terrane::internal {

FindTriangleDeviations find_triangle_deviations(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return kFindTriangleDeviationsAvx512;
    if (level == SimdLevel::avx2) return kFindTriangleDeviationsAvx2;
#else
    static_cast<void>(level);
#endif
    return kFindTriangleDeviationsBaseline;
}

}  // namespace terrane::internal
