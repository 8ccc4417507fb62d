// SPDX-License-Identifier: MIT

#define TERRANE_RAISE_DEVIATIONS kRaiseDeviationsBaseline
#include "source/cell_deviation_impl.h"
