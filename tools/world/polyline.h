// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

namespace terrane::tools {

/// A line of points in the plane by its arc length, metres.
class Polyline {
public:
    /// Requires two points or more, no two successive ones equal.
    explicit Polyline(std::vector<Eigen::Vector2d> points_world);

    double length() const { return lengths_.back(); }
    /// The point at a distance from the first one, which is clamped to 0 to length().
    Eigen::Vector2d at(double along) const;
    /// The unit direction there.
    Eigen::Vector2d direction(double along) const;
    const std::vector<Eigen::Vector2d>& points() const { return points_; }

private:
    std::size_t segment(double along) const;  // index of its end

    std::vector<Eigen::Vector2d> points_;
    std::vector<double> lengths_;  // of the line up to each point
};

}  // namespace terrane::tools
