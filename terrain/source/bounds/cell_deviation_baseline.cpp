// SPDX-License-Identifier: MIT
#define TERRANE_RAISE_DEVIATIONS kRaiseDeviationsBaseline
#include "source/bounds/cell_deviation_impl.h"
