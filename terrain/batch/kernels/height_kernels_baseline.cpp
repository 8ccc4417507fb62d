// SPDX-License-Identifier: MIT
#define TERRANE_KERNELS height_kernels_baseline
#include "batch/kernels/height_kernels_impl.h"
