// SPDX-License-Identifier: MIT

#define TERRANE_KERNELS key_kernels_baseline
#include "lod/key_kernels_impl.h"
