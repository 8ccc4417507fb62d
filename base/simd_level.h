// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::internal {

/// Widest vector instructions that a kernel may use. All levels compute the same bits: lanes do the operations of the
/// scalar code in the same order, without fused multiply-add.
///
/// A kernel is one source, compiled once for each level under its own name. Such a source contains only functions of
/// internal linkage and includes no header with inline functions: the linker could choose a copy with wide
/// instructions for the whole program.
enum class SimdLevel { baseline, avx2, avx512 };

/// The level of this machine. The first call queries the processor.
SimdLevel best_simd_level();

}  // namespace terrane::internal
