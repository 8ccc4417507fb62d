// SPDX-License-Identifier: MIT
#include "ground/height_kernels.h"

namespace terrane::internal {

extern const HeightKernels height_kernels_baseline;
#if defined(__x86_64__)
extern const HeightKernels height_kernels_avx2;
extern const HeightKernels height_kernels_avx512;
#endif

const HeightKernels& height_kernels(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return height_kernels_avx512;
    if (level == SimdLevel::avx2) return height_kernels_avx2;
#endif
    static_cast<void>(level);
    return height_kernels_baseline;
}

}  // namespace terrane::internal
