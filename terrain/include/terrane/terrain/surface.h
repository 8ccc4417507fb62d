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

/// What contact needs to know of the ground's surface at a place.
struct SurfaceProperties {
    double friction = 0.6;       ///< Coulomb, 0 to 1e6
    double restitution = 0.0;    ///< ratio of separating to approaching speed, 0 to 1
    std::uint32_t material = 0;  ///< the caller's number of a material; Terrane gives it no meaning
    bool operator==(const SurfaceProperties&) const = default;
};

/// Fails: invalid_argument, naming the field and its value, for one out of range or NaN
Result<void> check(const SurfaceProperties& properties);

/// A rectangle of one surface. Its edges are part of it, may be infinite, and may coincide.
struct SurfaceRect {
    WorldRect rect = {};                ///< metres, west <= east, south <= north
    SurfaceProperties properties = {};  ///< everywhere in it
};

/// Surface properties by place, which a Ground answers. Immutable; shared by any number of grounds.
///
/// Made of a function, of rectangles, of a raster (SurfaceRaster in surface_raster.h), or by a class of your own,
/// which answers in properties().
class SurfaceMap {
public:
    /// A map that calls a function of world x and y, metres, which must answer the same for the same place, from any
    /// number of threads at once.
    ///
    /// Fails: invalid_argument for an empty function, or defaults out of range
    static Result<std::shared_ptr<const SurfaceMap>> from_function(
        std::function<SurfaceProperties(double x, double y)> function,
        const SurfaceProperties& defaults = {});

    /// A map of rectangles in any number: the last one that contains a place answers there, the defaults elsewhere.
    ///
    /// Fails: invalid_argument for an edge that is NaN, edges in the wrong order, or properties out of range, named
    ///        as rects[index] with the value
    /// Cost:  of an answer O(log n) where few rectangles overlap, at most O(n)
    static Result<std::shared_ptr<const SurfaceMap>> from_rects(
        std::span<const SurfaceRect> rects, const SurfaceProperties& defaults = {});

    virtual ~SurfaceMap() = default;
    SurfaceMap(const SurfaceMap&) = delete;
    SurfaceMap& operator=(const SurfaceMap&) = delete;

    /// The properties at world (x, y), metres: always in range, the same bits for the same place. A map that answers
    /// out of range or throws counts as a fault, and the defaults answer; they also do where x or y is not finite.
    ///
    /// Threads:   any number at once
    /// Allocates: nothing, unless the map's function does
    SurfaceProperties at(double x, double y) const noexcept;

    /// The properties where the map has no others.
    const SurfaceProperties& defaults() const { return defaults_; }
    /// Calls of at() so far that the map answered out of range, or by an exception.
    std::uint64_t fault_count() const { return fault_count_.load(std::memory_order_relaxed); }

protected:
    /// Requires defaults that check() accepts.
    explicit SurfaceMap(const SurfaceProperties& defaults);

private:
    /// The properties at a place with finite coordinates; as a function of from_function().
    virtual SurfaceProperties properties(double x, double y) const = 0;

    SurfaceProperties defaults_;
    mutable std::atomic<std::uint64_t> fault_count_{0};
};

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
