// SPDX-License-Identifier: MIT
#define TERRANE_KERNELS key_kernels_baseline
#include "key_kernels_impl.h"
