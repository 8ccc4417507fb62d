// SPDX-License-Identifier: MIT

#define TERRANE_NOISE_KERNELS kNoiseKernelsAvx512
#include "source/fractal/noise_kernels_impl.h"
