// SPDX-License-Identifier: MIT
#include "source/noise/noise_kernels.h"

namespace terrane::internal {

const NoiseKernels& noise_kernels(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return kNoiseKernelsAvx512;
    if (level == SimdLevel::avx2) return kNoiseKernelsAvx2;
#else
    static_cast<void>(level);
#endif
    return kNoiseKernelsBaseline;
}

}  // namespace terrane::internal
