// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/height_source.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// A position in the world's plane, metres.
struct PlanePoint {
    double x = 0.0;  ///< world, east
    double y = 0.0;  ///< world, north
    friend bool operator==(const PlanePoint&, const PlanePoint&) = default;
};

/// An area of the world's plane, edges included: its corners in order, clockwise or counter-clockwise; the last one is
/// joined to the first. If edges cross, a position is inside if a ray from it crosses an odd number of edges.
struct Polygon {
    std::vector<PlanePoint> corners;  ///< at least 3, finite

    /// Fails: invalid_argument, naming the corner, for fewer than 3 corners or a corner that is not finite
    Result<void> validate() const;
};

/// The corners of a rectangle.
Polygon polygon_of(const WorldRect& rect);

/// Forwards all calls to another source: a base class for sources that change some answers of the other, for example to
/// add delays or volumes.
///
/// Threads: as HeightSource
class ForwardedHeights : public HeightSource, public ChunkSource {
public:
    // see HeightSource
    double height(double x, double y) const override { return heights_->height(x, y); }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        return heights_->sample(grid, heights_out);
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return heights_->vertex_bounds(grid, bounds_out);
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return heights_->cell_bounds(grid, bounds_out);
    }
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        return heights_->mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
    }
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        return heights_->cell_flags(grid, flags_out);
    }
    HeightInterval interval(const WorldRect& rect) const override {
        return heights_->interval(rect);
    }
    double rise_bound(double distance) const override { return heights_->rise_bound(distance); }
    bool is_certified() const override { return heights_->is_certified(); }
    // see ChunkSource
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override {
        return chunks_->stored_chunk(key, stop);
    }
    void expect_chunks(std::span<const ChunkKey> keys) const override {
        chunks_->expect_chunks(keys);
    }
    std::optional<SolidExtent> solid_extent(const ChunkKey& key) const override {
        return chunks_->solid_extent(key);
    }
    bool is_in_volume(double x, double y, double z) const override {
        return chunks_->is_in_volume(x, y, z);
    }
    std::size_t max_chunk_bytes(const ChunkKey& key) const override {
        return chunks_->max_chunk_bytes(key);
    }
    bool is_current(const Chunk& chunk) const override { return chunks_->is_current(chunk); }

    /// The source that calls are forwarded to.
    const HeightSource& heights() const { return *heights_; }

protected:
    /// Requires that `heights` is not null.
    explicit ForwardedHeights(std::shared_ptr<const HeightSource> heights)
        : HeightSource(heights->lattice(), heights->extent()),
          heights_(std::move(heights)),
          chunks_(&chunks_of(*heights_)) {}

private:
    std::shared_ptr<const HeightSource> heights_;
    const ChunkSource* chunks_;  // of heights_
};

/// Sources that are composed of two others, their parts. All of them
///   - have the lattice of their parts, which must be the same for both;
///   - are certified if both parts are (HeightSource::is_certified()), and derive their bounds from the parts' bounds;
///   - are heightfields: volumes are added to the result (VolumeHeights), not to a part.

/// Interval of a mask's values over a rectangle, 0 <= least <= most <= 1.
struct MaskInterval {
    double least = 0.0;  ///< lower bound
    double most = 1.0;   ///< upper bound
};

/// Share of the second source in a blend, by position: 0 none, 1 all.
///
/// Threads: any number at once
class BlendMask {
public:
    virtual ~BlendMask() = default;
    BlendMask(const BlendMask&) = delete;
    BlendMask& operator=(const BlendMask&) = delete;

    /// The mask at any finite position, 0 to 1: a pure function of the position.
    /// Fails: NaN where the mask has no value
    virtual double at(double x, double y) const = 0;
    /// Interval that contains all values over a rectangle. That of a square contains those of all squares within it.
    virtual MaskInterval over(const WorldRect& rect) const = 0;
    /// The rectangle outside which the mask is 0, metres; may be infinite.
    virtual WorldRect support() const = 0;
    /// Lipschitz bound of the mask, 1/m.
    double slope() const { return slope_; }

protected:
    /// @param slope Lipschitz bound, 1/m
    explicit BlendMask(double slope) : slope_(slope) {}

private:
    double slope_;
};

/// A mask that calls a function and clamps its values to between 0 and 1. If the function throws or returns NaN, the
/// blend's sample() fails with a message of one line that names the position.
///
/// @param slope  Lipschitz bound of the function, 1/m, 0 to 1e6
///
/// Fails: invalid_argument for an empty function, or a slope out of range
Result<std::shared_ptr<const BlendMask>> mask_from_function(
    std::function<double(double x, double y)> function, double slope);

/// A mask that is 1 in a polygon and falls smoothly to 0 with the distance from it.
///
/// @param feather  distance from the polygon at which the mask reaches 0, metres, > 0
///
/// Fails: invalid_argument for a polygon that validate() refuses, or a feather that is not above 0
/// Cost:  O(corners) per value near the polygon, O(1) elsewhere
Result<std::shared_ptr<const BlendMask>> mask_from_polygon(const Polygon& polygon, double feather);

/// One source plus a multiple of another: z = a + factor * b. A cell is ground if it is ground in both.
///
/// Fails: invalid_argument for sources of different lattices, extents that do not overlap, or a factor beyond +-1e6
Result<std::shared_ptr<const HeightSource>> sum_heights(std::shared_ptr<const HeightSource> a,
                                                        std::shared_ptr<const HeightSource> b,
                                                        double factor = 1.0);

/// Blends two sources by a mask m: z = (1 - m) a + m b. Where m is 0 or 1, heights and cell flags are bit-identical to
/// a or b.
///
/// Over a triangle with longest edge l, bounds e_a and e_b of the sources, m in [least, most] and |a - b| <= d, the
/// bound is the larger of (1 - m) e_a + m e_b at m = least and m = most, plus d * min(most - least, slope l / 2).
///
/// Fails: invalid_argument for sources of different lattices, or extents that do not overlap
/// Cost:  a sample of both sources per sample if the mask is between 0 and 1, else a sample of one
Result<std::shared_ptr<const HeightSource>> blend_heights(std::shared_ptr<const HeightSource> a,
                                                          std::shared_ptr<const HeightSource> b,
                                                          std::shared_ptr<const BlendMask> mask);

/// An area that is flattened, such as an airfield or a piece of road: in the polygon the ground is the plane
/// z = height + slope_x (x - x0) + slope_y (y - y0) through the polygon's first corner (x0, y0).
struct FlatArea {
    Polygon polygon = {};   ///< where the ground is the plane
    double feather = 10.0;  ///< width of the transition from the plane to the ground, metres, > 0
    double height = 0.0;    ///< world z at the first corner, metres
    double slope_x = 0.0;   ///< rise of the plane to the east, -1e3 to 1e3
    double slope_y = 0.0;   ///< rise of the plane to the north, -1e3 to 1e3
};

/// A source with flat areas, applied in order: where two overlap, the later one prevails.
///
/// Fails: invalid_argument, naming areas[index], for a value out of range
/// Cost:  at least O(areas) per grid, plus O(samples) for each area that the grid touches
Result<std::shared_ptr<const HeightSource>> flatten_heights(
    std::shared_ptr<const HeightSource> base, std::span<const FlatArea> areas);

}  // namespace terrane
