// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <functional>
#include <memory>

namespace terrane::test {

/// Position and lattice of a test ground.
struct TableGroundSettings {
    double spacing = 1.0;         ///< between samples, metres
    int roots = 1;                ///< root squares along a side; their 128 cells are the chunks
    double origin_x = 0.0;        ///< world x of lattice point (0, 0), metres
    double origin_y = 0.0;        ///< world y of lattice point (0, 0), metres
    std::int32_t first_root = 0;  ///< x and y of the south-western root square's key
    double quantum = 0x1p-12;     ///< metres
    float bound = 0.0f;           ///< every bound of the source
    std::function<bool(double, double)> is_outside{};  ///< of a cell's centre; none: all is ground
    std::function<bool(int, int)> is_resident{};  ///< of a root by column and row; none: all are
    std::shared_ptr<const SurfaceMap> surface{};  ///< null: none
    std::function<std::shared_ptr<const SolidSurface>(const Chunk&)>
        solid{};  ///< of a chunk; none: the heightfield alone
};

/// Ground over an analytic height, every chunk resident unless the settings say otherwise. Level 0
/// is the contact level; the samples are `height` at the lattice, rounded to quanta.
Ground make_test_ground(std::function<double(double, double)> height,
                        const TableGroundSettings& settings = {});

/// The same with the two settings that most tests use.
Ground make_test_ground(std::function<double(double, double)> height, double spacing, int roots);

}  // namespace terrane::test
