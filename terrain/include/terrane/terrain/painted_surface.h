// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/polygon.h>
#include <terrane/terrain/surface.h>

#include <memory>
#include <span>

namespace terrane {

/// An area of the ground with a surface of its own: a runway, a road, a place where a raster is known better.
struct SurfaceArea {
    Polygon polygon = {};               ///< its edges included
    SurfaceProperties properties = {};  ///< everywhere in it, where there is no map
    /// Answers in the area in place of `properties`, if not null. Where it answers its own defaults, as a raster does
    /// where there is nodata, what is under the area shows.
    std::shared_ptr<const SurfaceMap> map = nullptr;
};

/// A map with areas painted over another one: the last area that contains a place answers there, and has an answer.
///
/// @param under answers elsewhere, and where x or y is not finite; null: default properties
///
/// Fails: invalid_argument, naming areas[index] and the value, for a polygon that check() refuses, or properties out of
///        range
/// Cost:  of an answer O(areas), and O(corners) of the areas whose boxes contain the place
Result<std::shared_ptr<const SurfaceMap>> paint_surface(std::shared_ptr<const SurfaceMap> under,
                                                        std::span<const SurfaceArea> areas);

}  // namespace terrane
