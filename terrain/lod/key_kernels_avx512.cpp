// SPDX-License-Identifier: MIT

#define TERRANE_KERNELS key_kernels_avx512
#include "lod/key_kernels_impl.h"
