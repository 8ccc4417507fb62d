// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::internal {

/// Widest vector instructions that a kernel may use. Results are bit-identical at all levels: lanes perform the
/// operations of the scalar code in the same order, without fused multiply-add.
///
/// Each kernel is one source file, compiled once per level under a different name. The file contains only functions
/// with internal linkage and includes no header with inline functions: otherwise the linker could choose, for the whole
/// program, a copy of such a function that has wide instructions.
///
/// Kernels use the compilers' vector types, not Highway. Highway 1.0.3 with g++ 12 computed the same bits, but took 4
/// to 22 times as long for the kernel `count` with AVX2, and 2.4 to 2.7 times for `trim_centres` with AVX-512. It has
/// no SSE2, and code for its vectors does not compile for scalars. The compilers' types compile for NEON unchanged.
enum class SimdLevel { baseline, avx2, avx512 };

/// The highest level that this machine supports. The first call queries the processor.
SimdLevel best_simd_level();

}  // namespace terrane::internal
