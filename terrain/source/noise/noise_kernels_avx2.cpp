// SPDX-License-Identifier: MIT
#define TERRANE_NOISE_KERNELS kNoiseKernelsAvx2
#include "source/noise/noise_kernels_impl.h"
