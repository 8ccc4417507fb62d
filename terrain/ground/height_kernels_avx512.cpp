// SPDX-License-Identifier: MIT

#define TERRANE_KERNELS height_kernels_avx512
#include "ground/height_kernels_impl.h"
