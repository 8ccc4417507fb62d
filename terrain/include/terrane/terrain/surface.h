// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/height_source.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

namespace terrane {

/// Contact properties of the ground's surface at a place.
struct SurfaceProperties {
    double friction = 0.6;       ///< Coulomb, 0 to 1e6
    double restitution = 0.0;    ///< ratio of separating to approaching speed, 0 to 1
    std::uint32_t material = 0;  ///< the caller's material number, not interpreted by Terrane
    bool operator==(const SurfaceProperties&) const = default;

    /// Checks the ranges of all fields.
    ///
    /// Fails: invalid_argument, naming the field and its value, for one out of range or NaN
    Result<void> validate() const;
};

/// A rectangle with uniform surface properties, edges included. Edges may be infinite and may coincide.
struct SurfaceRect {
    WorldRect rect = {};                ///< metres, west <= east, south <= north
    SurfaceProperties properties = {};  ///< everywhere in it
};

/// Surface properties by place, queried through Ground. Immutable; any number of grounds may share a map.
///
/// Created from a function, from rectangles, from a raster (SurfaceRaster in surface_raster.h), or by deriving a class
/// that implements properties().
class SurfaceMap {
public:
    /// Creates a map from a function of world x and y, metres. The function must be pure and is called from any number
    /// of threads at once.
    ///
    /// Fails: invalid_argument for an empty function, or defaults out of range
    static Result<std::shared_ptr<const SurfaceMap>> from_function(
        std::function<SurfaceProperties(double x, double y)> function,
        const SurfaceProperties& defaults = {});

    /// Creates a map from any number of rectangles: the last one that contains a place applies there, the defaults
    /// elsewhere.
    ///
    /// Fails: invalid_argument for an edge that is NaN, edges in the wrong order, or properties out of range, named
    ///        as rects[index] with the value
    /// Cost:  O(log n) per query if few rectangles overlap, at most O(n)
    static Result<std::shared_ptr<const SurfaceMap>> from_rects(
        std::span<const SurfaceRect> rects, const SurfaceProperties& defaults = {});

    virtual ~SurfaceMap() = default;
    SurfaceMap(const SurfaceMap&) = delete;
    SurfaceMap& operator=(const SurfaceMap&) = delete;

    /// The properties at world (x, y), metres: always in range, and bit-identical for the same place. Returns the
    /// defaults if x or y is not finite; also if properties() throws or is out of range, which is counted as a fault.
    ///
    /// Threads:   any number at once
    /// Allocates: nothing, unless the map's function does
    SurfaceProperties at(double x, double y) const noexcept;

    /// The properties that hold where the map specifies none.
    const SurfaceProperties& defaults() const { return defaults_; }
    /// Number of calls of at() in which properties() threw or was out of range.
    std::uint64_t fault_count() const { return fault_count_.load(std::memory_order_relaxed); }

protected:
    /// Requires defaults that validate() accepts.
    explicit SurfaceMap(const SurfaceProperties& defaults);

private:
    /// The properties at a place with finite coordinates; same contract as the function of from_function().
    virtual SurfaceProperties properties(double x, double y) const = 0;

    SurfaceProperties defaults_;
    mutable std::atomic<std::uint64_t> fault_count_{0};
};

/// An area of the ground with its own surface: a runway, a road, a region with a better raster.
struct SurfaceArea {
    Polygon polygon = {};               ///< its edges included
    SurfaceProperties properties = {};  ///< everywhere in it, if `map` is null
    /// Replaces `properties` in the area, if not null. Where this map returns its own defaults, as a raster does at
    /// nodata, the area is transparent.
    std::shared_ptr<const SurfaceMap> map = nullptr;
};

/// Creates a map with areas painted over another map: at each place the last non-transparent area that contains it
/// applies.
///
/// @param under applies elsewhere, and if x or y is not finite; null: default properties
///
/// Fails: invalid_argument, naming areas[index] and the value, for a polygon that validate() rejects, or properties out
///        of range
/// Cost:  per query O(areas), plus O(corners) of the areas whose boxes contain the place
Result<std::shared_ptr<const SurfaceMap>> paint_surface(std::shared_ptr<const SurfaceMap> under,
                                                        std::span<const SurfaceArea> areas);

}  // namespace terrane
