// SPDX-License-Identifier: MIT

#define TERRANE_RAISE_DEVIATIONS kFindMaxDeviationsBaseline
#include "source/cell_deviation_impl.h"
