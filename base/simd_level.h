// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::internal {

/// Widest vector instructions that a kernel may use. All levels compute the same bits: lanes perform the operations of
/// the scalar code in the same order, without fused multiply-add.
///
/// A kernel is one source, compiled once per level under a name of its own. Such a source contains only functions with
/// internal linkage and includes no header with inline functions: the linker could otherwise choose a copy with wide
/// instructions for the whole program.
///
/// Kernels use the compilers' vector types, not Highway. Highway 1.0.3 with g++ 12 computed the same bits, but took 4
/// to 22 times as long for the kernel `count` with AVX2, and 2.4 to 2.7 times for `trim_centres` with AVX-512. It has
/// no SSE2, and its vectors cannot share a function with scalars. The compilers' types compile for NEON unchanged.
enum class SimdLevel { baseline, avx2, avx512 };

/// The highest level that this machine supports. The first call queries the processor.
SimdLevel best_simd_level();

}  // namespace terrane::internal
