// SPDX-License-Identifier: MIT
#define TERRANE_NOISE_KERNELS kNoiseKernelsBaseline
#include "noise_kernels_impl.h"
