// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::internal {

/// Widest vector instructions that a kernel may use. All levels compute the same bits: lanes do what
/// the scalar code does, in the same order, without fused products.
///
/// A kernel is one source, compiled once for each level under a name of its own. Such a source holds
/// only functions of internal linkage, and includes no header with inline functions: the linker could
/// take a copy of those with wide instructions for everybody.
enum class SimdLevel { baseline, avx2, avx512 };

/// What this machine runs. The first call asks the processor.
SimdLevel best_simd_level();

}  // namespace terrane::internal
