// SPDX-License-Identifier: MIT
//
// Included by sources that are compiled once for each SimdLevel: contains only plain data, no inline functions.
#pragma once

#include "base/simd_level.h"

#include <cstddef>

namespace terrane::internal {

/// Longest leg of a triangle, in cells.
inline constexpr int kMaxLeg = 128;
/// Values after the last point of a phase that are readable, because several triangles are evaluated at once.
inline constexpr int kPhasePadding = 8;

/// Heights of a window of points. Points that are `stride` columns apart are neighbours in memory: they have the same
/// *phase*, their column modulo the stride.
struct PhasedHeights {
    const double* values = nullptr;  ///< [row][phase][pitch]
    int log2_stride = 1;
    std::size_t pitch = 0;
};

/// The height of a triangle's plane at its right-angled corner.
enum class CornerHeight {
    surface,  ///< that of the surface
    mean_x,   ///< the mean of the surface's heights one leg to the west and to the east
    mean_y,   ///< the mean of the surface's heights one leg to the south and to the north
};

/// A right triangle with legs along the axes, relative to a point. At the ends of its legs its plane has the heights of
/// the surface.
struct TriangleShape {
    int x = 0, y = 0;  ///< the right-angled corner
    int sign_x = 1, sign_y = 1;
    int leg = 1;  ///< 1 to kMaxLeg, a power of two
    CornerHeight corner = CornerHeight::surface;
};

/// Finds the largest deviation of a bilinear surface from the planes of some triangles, all with one length of legs, at
/// each of `count` points (x, y), (x + stride, y), (x + 2 stride, y) ..., rounded by round_outward(). Results are
/// bit-identical at all levels.
using FindTriangleDeviations = void (*)(const PhasedHeights& heights, const TriangleShape* shapes,
                                        int shape_count, int x, int y, int count, float* out);

/// Requires a level that this machine supports.
FindTriangleDeviations find_triangle_deviations(SimdLevel level);

extern const FindTriangleDeviations kFindTriangleDeviationsBaseline;
#if defined(__x86_64__)
extern const FindTriangleDeviations kFindTriangleDeviationsAvx2;
extern const FindTriangleDeviations kFindTriangleDeviationsAvx512;
#endif

}  // namespace terrane::internal
