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

/// The bilinear amplitude of a DetailField, with a pyramid of maxima.
class AmplitudeField {
public:
    /// Requires a field that was checked.
    explicit AmplitudeField(const DetailField& field);

    /// The two nodes around a coordinate; beyond the field, both are its outermost node.
    struct Place {
        int low = 0, high = 0;
        double fraction = 0.0;
    };
    Place place_x(double x) const { return place(x, origin_x_, spacing_x_, columns_); }
    Place place_y(double y) const { return place(y, origin_y_, spacing_y_, rows_); }

    double amplitude(const Place& x, const Place& y) const;

    /// Bounds over a closed rectangle; they are at least the bounds over any rectangle within it.
    AmplitudeBounds over(const WorldRect& rect) const;

    /// Bounds everywhere.
    AmplitudeBounds everywhere() const;

private:
    /// Largest amplitude and largest slopes along the axes over a square block of cells between nodes.
    struct Block {
        float most = 0.0f, slope_x = 0.0f, slope_y = 0.0f;
        void include(const Block& other);
    };
    struct Level {
        int columns = 0, rows = 0;
        std::vector<Block> blocks;
    };
    /// First and last cell of a range, inclusive.
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
    std::vector<Level> levels_;  ///< [0] has one block per cell, the last level a single one
};

}  // namespace terrane
