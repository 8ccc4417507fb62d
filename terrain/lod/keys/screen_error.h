// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/open_chunk.h"
#include "lod/keys/vertex_key.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// The *reach* of a vertex: a box around it that encloses the true surface over its diamond and the reaches of all its
/// descendants, so that the distance from the eye to it does not decrease from parent to child. This one is from
/// the source's rise bound; chunks store tighter intervals of height for their own vertices, which nest up to
/// kNestMargin.
struct Reach {
    float half_width = 0.0f;   ///< metres
    float half_height = 0.0f;  ///< metres
};

/// Upper bounds of reaches by log2 of the vertex's spacing in finest spacings.
struct Reaches {
    std::vector<Reach> centre;
    std::vector<Reach> midpoint;
};
Reaches make_reaches(const HeightSource& source);

/// Lower bound of the distance from a point to the true surface, metres, from the source's intervals around it: holds
/// where chunks are absent, too.
double clearance_of(const HeightSource& source, const WorldPos& eye);

/// The screen error of vertical deviations from one eye.
///
/// The *key* of a vertex orders refinement: the squared distance from the eye to the vertex's reach over the square of
/// its bound, larger outside the view. Smaller keys refine first; a key is (pixels_per_radian / priority)^2, where the
/// priority is the screen error in pixels. Keys are floats, computed in one fixed order of operations.
class ScreenError {
public:
    /// Pixels computed from keys are upper bounds after multiplication by this: the square root of kNestMargin, and
    /// the rounding of keys.
    static constexpr double kRounding = 1.0 + 0x1p-10 + 0x1p-16;

    /// @param clearance  clearance_of() the view's eye, metres
    ScreenError(const View& view, const HeightSource& source, double clearance);

    float key_of(double error_px) const;
    double error_px_of(float key) const;
    /// Screen error, pixels, of a vertical deviation, metres, at a distance of the true surface, metres.
    double error_px_at(double bound, double distance) const;

    void fill_axes(const Chunk& chunk, ChunkAxes& axes_out) const;
    EyeHeights eye_heights(const Chunk& chunk) const;
    float height_over_eye(double height) const;

    /// An axis-aligned box, world, metres.
    struct WorldBox {
        Eigen::Vector3d low, high;
    };
    /// Of the samples of a chunk or an area.
    WorldBox box_of(const Chunk& chunk) const;
    WorldBox box_of_area(const Chunk& chunk, int area) const;
    /// Encloses the reaches of a chunk's own vertices, or of an area's, of this half width.
    WorldBox reach_of(const Chunk& chunk, float half_width) const;
    WorldBox reach_of_area(const Chunk& chunk, int area, float half_width) const;

    /// Lower bound of the keys of vertices with reaches in the box and at most this bound.
    /// @param is_in_view  the box is known to be inside the view
    float least_key(const WorldBox& reach, float largest_bound, bool is_in_view = false) const;

    /// The side planes of the view that a box is not entirely inside of: only they affect keys in it.
    KeyPlanes planes_across(const WorldBox& box) const;
    bool is_inside(const WorldBox& box) const { return planes_across(box).count == 0; }

    /// Largest screen error, pixels, of a vertical deviation by `bound` at a point of a box; 0 if no point of it is
    /// in view. Rounded up.
    double error_in_view(const WorldBox& box, double bound) const;

    using Triangle = std::array<Eigen::Vector3d, 3>;  ///< world
    /// The same for a surface that is vertically within `bound` of a triangle.
    double error_in_view(const Triangle& triangle, double bound) const;

private:
    Lattice lattice_;
    WorldPos eye_;
    double near_ = 1.0;
    double clearance_ = 0.0;  ///< lower bound of the distance to the true surface, metres
    double pixels_ = 1.0;
    Frustum frustum_;
    float near_squared_ = 1.0f;
};

}  // namespace terrane::internal
