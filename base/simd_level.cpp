// SPDX-License-Identifier: MIT
#include "base/simd_level.h"

namespace terrane::internal {

SimdLevel best_simd_level() {
#if defined(__x86_64__)
    static const SimdLevel level = [] {
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")) {
            return SimdLevel::avx512;
        }
        return __builtin_cpu_supports("avx2") ? SimdLevel::avx2 : SimdLevel::baseline;
    }();
    return level;
#else
    return SimdLevel::baseline;
#endif
}

}  // namespace terrane::internal
