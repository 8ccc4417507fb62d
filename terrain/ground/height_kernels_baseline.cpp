// SPDX-License-Identifier: MIT

#define TERRANE_KERNELS height_kernels_baseline
#include "ground/height_kernels_impl.h"
