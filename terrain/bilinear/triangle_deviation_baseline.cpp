// SPDX-License-Identifier: MIT

#define TERRANE_FIND_TRIANGLE_DEVIATIONS kFindTriangleDeviationsBaseline
#include "bilinear/triangle_deviation_impl.h"
