// SPDX-License-Identifier: MIT
#include "lod/key_kernels.h"

namespace terrane::internal {

extern const KeyKernels key_kernels_baseline;
#if defined(__x86_64__)
extern const KeyKernels key_kernels_avx2;
extern const KeyKernels key_kernels_avx512;
#endif

const KeyKernels& key_kernels(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return key_kernels_avx512;
    if (level == SimdLevel::avx2) return key_kernels_avx2;
#endif
    static_cast<void>(level);
    return key_kernels_baseline;
}

}  // namespace terrane::internal
