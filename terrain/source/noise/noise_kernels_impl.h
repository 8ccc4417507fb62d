// SPDX-License-Identifier: MIT
//
// The loops of NoiseKernels, for whatever vectors the including source is compiled for. Lanes do
// what noise() in noise.cpp does, operation by operation. Everything here has internal linkage, and
// the intrinsics are always inlined: nothing with wide instructions can reach other code.
//
// TERRANE_NOISE_KERNELS is the name of the table that the including source defines.
#include "source/noise/noise_points_impl.h"
#include "source/noise/noise_rows_impl.h"

namespace terrane::internal {

const NoiseKernels TERRANE_NOISE_KERNELS = {
    place, arrange, find_gradients, blend, add, add_weighted<ridge>, add_weighted<lift>,
    move,  enclose, add_points};

}  // namespace terrane::internal
