// SPDX-License-Identifier: MIT

#define TERRANE_RAISE_DEVIATIONS kFindMaxDeviationsAvx512
#include "source/cell_deviation_impl.h"
