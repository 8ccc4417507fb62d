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

/// A box around a vertex that holds every point of the true surface over its diamond and the boxes
/// of all its descendants: so the distance from the eye to it does not shrink from parent to child. Here
/// by how much the source rises anywhere; chunks have tighter heights for the vertices of their own
/// spacing, which nest but for a little.
struct Reach {
    float across = 0.0f;  ///< half its width, metres
    float up = 0.0f;      ///< half its height, metres
};

/// Upper bounds of reaches, by power of two of the vertex's spacing in finest spacings.
struct Reaches {
    std::vector<Reach> centre;
    std::vector<Reach> midpoint;
};
Reaches make_reaches(const HeightSource& source);

/// How far the true surface is from a point at least, metres, by what the source guarantees of it around
/// the point: where a chunk is absent, nothing else is known of the ground there.
double clearance_of(const HeightSource& source, const WorldPos& eye);

/// The screen error of vertical deviations from one eye.
///
/// What orders vertices is their *key*: the squared distance from the eye to the vertex's reach,
/// over the square of its bound, raised beside the view. Smaller keys refine first; a key is
/// (pixels_per_radian / screen error in pixels)^2. Keys are single precision, in one fixed order of
/// operations.
class ScreenError {
public:
    /// Pixels that follow from keys are upper bounds once multiplied by this: the root of
    /// kNestMargin, and the rounding of keys.
    static constexpr double kRounding = 1.0 + 0x1p-10 + 0x1p-16;

    /// @param clearance  clearance_of() the view's eye, metres
    ScreenError(const View& view, const HeightSource& source, double clearance);

    float key_of(double error_px) const;
    double error_px_of(float key) const;
    /// What a vertical deviation, metres, makes at a distance, metres, of the true surface.
    double error_px_at(double bound, double distance) const;

    void fill_axes(const Chunk& chunk, ChunkAxes& axes_out) const;
    EyeHeights eye_heights(const Chunk& chunk) const;
    float height_over_eye(double height) const;

    /// A box with sides along the axes, world.
    struct Box {
        Eigen::Vector3d low, high;
    };
    Box box_of(const Chunk& chunk) const;
    Box box_of_area(const Chunk& chunk, int area) const;
    /// Holds the reaches of a chunk's own vertices, or of an area's, half as wide as `across`.
    Box reach_of(const Chunk& chunk, float across) const;
    Box reach_of_area(const Chunk& chunk, int area, float across) const;

    /// No vertex with a reach in the box and at most this bound has a smaller key.
    /// @param is_in_view  whether the box is known not to lie beside the view
    float least_key(const Box& reach, float largest_bound, bool is_in_view = false) const;

    /// Side planes of the view that a box does not lie wholly inside of, for certain: the others do
    /// not matter to vertices in it.
    KeyPlanes planes_across(const Box& box) const;
    bool is_inside(const Box& box) const { return planes_across(box).count == 0; }

    /// Largest screen error, pixels, that a vertical deviation by `bound` can make at a point of a
    /// box, 0 where no point of it is in view. Rounded outward.
    double error_in_view(const Box& box, double bound) const;

    using Triangle = std::array<Eigen::Vector3d, 3>;  ///< world
    /// The same where the surface is within `bound` of a triangle, vertically.
    double error_in_view(const Triangle& triangle, double bound) const;

private:
    Lattice lattice_;
    WorldPos eye_;
    double near_ = 1.0;
    double clearance_ = 0.0;  ///< no point of the true surface is closer to the eye, metres
    double pixels_ = 1.0;
    Frustum frustum_;
    float near_squared_ = 1.0f;
};

}  // namespace terrane::internal
