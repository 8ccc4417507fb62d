// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/terrain/view.h>

#include <memory>
#include <string>
#include <vector>

namespace terrane::bench {

/// Ground that the error table measures.
struct Place {
    std::string name;
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const test::TableHeights> table;  ///< the same, where it is a table
    bool is_fractal = false;
    double altitude = 100.0;  ///< of the eyes, metres
};

struct Places {
    std::vector<Place> grounds;
    std::vector<Place> tables;  ///< fBm maps, and squares cut out of the rasters
};

/// fBm maps, real rasters if present (a line names absent ones), fractals of every kind.
Places make_places(bool quick);

/// Views from three positions towards the middle of the extent, `altitude` over the ground.
std::vector<View> views_of(const Place& place);

}  // namespace terrane::bench
