// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/fractal_heights.h>

#include <vector>

namespace terrane {

/// Upper bounds over a piece of an amplitude field.
struct AmplitudeBounds {
    double most = 0.0;   ///< amplitude, metres
    double slope = 0.0;  ///< length of its gradient
};

/// The bilinear amplitude of a DetailField, with a pyramid of maxima over it.
class AmplitudeField {
public:
    /// Requires: a checked field.
    explicit AmplitudeField(const DetailField& field);

    /// The two nodes around a coordinate; the same one twice beyond the field.
    struct Place {
        int low = 0, high = 0;
        double fraction = 0.0;
    };
    Place place_x(double x) const { return place(x, origin_x_, spacing_x_, columns_); }
    Place place_y(double y) const { return place(y, origin_y_, spacing_y_, rows_); }

    double amplitude(const Place& x, const Place& y) const;

    /// Bounds over a closed rectangle. Never smaller over a rectangle that contains it.
    AmplitudeBounds over(const WorldRect& rect) const;

    /// Bounds everywhere.
    AmplitudeBounds everywhere() const;

private:
    /// Of a square of node cells: largest amplitude, largest slopes along the axes.
    struct Block {
        float most = 0.0f, slope_x = 0.0f, slope_y = 0.0f;
        void include(const Block& other);
    };
    struct Level {
        int columns = 0, rows = 0;
        std::vector<Block> blocks;
    };
    /// First and last of the cells that a stretch touches.
    struct Stretch {
        int first = 0, last = 0;
    };

    static Place place(double coordinate, double origin, double spacing, int nodes);
    static Stretch stretch(const Place& from, const Place& to, int cells);
    double node(int column, int row) const;
    Block make_cell(int column, int row) const;

    double origin_x_, origin_y_, spacing_x_, spacing_y_;
    int columns_, rows_;
    std::vector<float> nodes_;
    std::vector<Level> levels_;  ///< [0] has a block for each cell, the last a single one
};

}  // namespace terrane
