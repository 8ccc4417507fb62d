// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/view.h>

#include <array>
#include <vector>

namespace terrane::internal {

/// Upper bounds, by level, of how far from a vertex the surface reaches that it answers for.
///
/// The radius of a vertex holds every point of the true surface over its diamond and over those of
/// all its descendants, and |v - child| + radius(child) <= radius(v): so that the distance left
/// after subtracting it does not grow from parent to child.
struct Radii {
    /// By power of two of the spacing, in finest spacings.
    std::vector<float> centre;
    std::vector<float> midpoint;
};
Radii make_radii(const HeightSource& source);

/// The screen error of vertical deviations from one eye, in pixels of the picture's centre.
///
/// Single precision, in one fixed order: a vertex on the border of two chunks gets the same bits from
/// both. Rounded so that it is an upper bound up to a factor of kRounding.
class ScreenError {
public:
    /// Results are upper bounds once multiplied by this.
    static constexpr double kRounding = 1.0 + 0x1p-16;

    ScreenError(const View& view, const Lattice& lattice);

    /// Positions of a chunk's columns and rows relative to the eye.
    struct Axes {
        std::array<float, kChunkSamples> x;
        std::array<float, kChunkSamples> y;
    };
    Axes axes(const Chunk& chunk) const;

    /// No vertex of the chunk, or of one of its areas, has a larger priority.
    float upper_bound(const Chunk& chunk, float largest_radius) const;
    float upper_bound(const Chunk& chunk, int area, float largest_radius) const;

    /// Whether all of a chunk's samples are inside the view's side planes.
    enum class Side { inside, crossing };
    Side side(const Chunk& chunk) const;

    /// Samples of one row of a chunk.
    struct Span {
        int row = 0;
        int first = 0;  ///< column
        int count = 0;  ///< at most kAreaCells + 1, or kChunkSamples
    };

    /// Priorities of part of a row of samples: bound * pixels / distance, weighted down beside the view.
    ///
    /// @param radii          [kChunkSamples] of the whole row's vertices
    /// @param priorities_out [kChunkSamples] of the whole row
    void priorities(const Chunk& chunk, const Axes& axes, const Span& span, const float* radii,
                    Side side, float* priorities_out) const;

    /// A box with sides along the axes, world.
    struct Box {
        Eigen::Vector3d low, high;
    };

    /// Largest screen error that a vertical deviation by `bound` can make at a point of a box, 0
    /// where no point of it is in view. Not more than kRounding below the truth.
    float error_in_view(const Box& box, double bound) const;

private:
    Box box_of(const Chunk& chunk) const;
    float upper_bound(const Box& box, double bound, double radius) const;

    Lattice lattice_;
    WorldPos eye_;
    double near_ = 1.0;
    double pixels_ = 1.0;
    Frustum frustum_;
};

}  // namespace terrane::internal
