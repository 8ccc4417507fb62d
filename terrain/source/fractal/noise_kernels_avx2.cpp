// SPDX-License-Identifier: MIT

#define TERRANE_NOISE_KERNELS kNoiseKernelsAvx2
#include "source/fractal/noise_kernels_impl.h"
