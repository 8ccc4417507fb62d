// SPDX-License-Identifier: MIT

#define TERRANE_FIND_TRIANGLE_DEVIATIONS kFindTriangleDeviationsAvx2
#include "bilinear/triangle_deviation_impl.h"
