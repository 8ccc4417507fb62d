// SPDX-License-Identifier: MIT
#define TERRANE_NOISE_KERNELS kNoiseKernelsBaseline
#include "source/noise/noise_kernels_impl.h"
