// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/convex_hull.h>
#include <terrane/collision/primitives.h>
#include <terrane/terrain/aabb.h>
#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>

namespace terrane {

/// What a part of a compound can be.
using ConvexShape = std::variant<Sphere, Capsule, Box, ConvexHull>;

/// A convex shape and its pose in the compound.
struct CompoundPart {
    ConvexShape shape;    ///< in the part's own frame
    Pose body_from_part;  ///< the rotation must be orthonormal to 1e-6
};

class Compound;
namespace internal {
struct CompoundData;
/// The parts as the queries read them.
const CompoundData& compound_data(const Compound& compound);
}  // namespace internal

/// The union of convex shapes; body frame, metres. Parts may overlap and keep their order: contacts name them by index.
/// Immutable; copies share their data.
///
/// Threads: any number at once
class Compound {
public:
    /// Most parts of a compound, and how far one may lie from the origin, metres.
    static constexpr std::size_t kMaxParts = 100'000;
    static constexpr double kLargestOffset =
        1e5;  ///< largest component of a part's translation, metres

    /// Fails: invalid_argument, naming the part, for no part or more than kMaxParts; a shape that check() refuses; a
    ///        translation that is not finite or beyond kLargestOffset; a rotation that is not orthonormal to 1e-6 with
    ///        determinant 1
    static Result<Compound> create(std::span<const CompoundPart> parts);

    /// The surface of a triangle mesh: one flat hull a triangle, in order. The mesh need not be closed, and its winding
    /// does not matter. It has no inside: a shape within a closed mesh touches nothing. For solids pass solid pieces to
    /// create().
    ///
    /// Fails: invalid_argument, naming the triangle, for no triangle or more than kMaxParts; an index beyond the
    ///        vertices; a vertex that is not finite or has a coordinate beyond 1e5 m
    /// Cost:  3 to 7 microseconds and about 1 kB a triangle
    static Result<Compound> from_triangles(std::span<const Eigen::Vector3d> vertices,
                                           std::span<const std::array<std::uint32_t, 3>> triangles);

    // A move copies, so that a moved-from compound keeps its data.
    Compound(const Compound&) = default;
    Compound& operator=(const Compound&) = default;

    /// The parts, in the order given to create().
    std::span<const CompoundPart> parts() const;

    /// Bounding box of every part, body frame, in the order of parts().
    std::span<const Aabb> bounds() const;

private:
    explicit Compound(std::shared_ptr<const internal::CompoundData> data);
    friend const internal::CompoundData& internal::compound_data(const Compound& compound);
    friend double bounding_radius(const Compound& compound);
    friend double smallest_half_extent(const Compound& compound);

    std::shared_ptr<const internal::CompoundData> data_;
};

/// Never fails: create() has checked the parts.
Result<void> check(const Compound& compound);

/// Largest distance of a point of any part from the body's origin, metres.
double bounding_radius(const Compound& compound);

/// The smallest of the parts', metres, because tolerances must suit the thinnest part; 0 for triangles.
double smallest_half_extent(const Compound& compound);

/// Largest coordinate of the compound along a unit direction of the body frame, metres; negative where all of it is
/// behind the origin.
///
/// Cost: linear in the parts
double support_distance(const Compound& compound, const Eigen::Vector3d& direction_body);

}  // namespace terrane
