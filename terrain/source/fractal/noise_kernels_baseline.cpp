// SPDX-License-Identifier: MIT

#define TERRANE_NOISE_KERNELS kNoiseKernelsBaseline
#include "source/fractal/noise_kernels_impl.h"
