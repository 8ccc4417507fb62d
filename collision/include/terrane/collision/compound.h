// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/aabb.h>
#include <terrane/collision/convex_hull.h>
#include <terrane/collision/primitives.h>
#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>

namespace terrane {

using ConvexShape = std::variant<Sphere, Capsule, Box, ConvexHull>;

struct CompoundPart {
    ConvexShape shape;
    Pose body_from_part;  ///< the rotation must be orthonormal to 1e-6
};

class Compound;
namespace internal {
struct CompoundData;
const CompoundData& compound_data(const Compound& compound);
}  // namespace internal

/// The union of convex shapes; body frame, metres. Parts may overlap, and keep their order: contacts
/// name them by index. Immutable and cheap to copy: copies share what was made.
///
/// Threads: any number at once
class Compound {
public:
    static constexpr std::size_t kMaxParts = 100'000;
    static constexpr double kLargestOffset =
        1e5;  ///< metres: translations of parts, each component

    /// Fails with invalid_argument, naming the part and what is wrong with it, where there is no part
    /// or more than kMaxParts; where check() of a shape fails; where a translation is not finite or
    /// beyond kLargestOffset; and where a rotation is not orthonormal to 1e-6, with determinant 1.
    static Result<Compound> create(std::span<const CompoundPart> parts);

    /// The surface of a triangle mesh, exactly: a flat hull for every triangle, in order. It need not
    /// be closed, and its winding does not matter. It has no inside: what lies within a closed mesh
    /// touches nothing. Where solid pieces are wanted, give them to create().
    ///
    /// Fails with invalid_argument, naming the triangle, where there is none or more than kMaxParts, an
    /// index is none of a vertex, or a vertex is not finite or has a coordinate beyond 1e5 m.
    ///
    /// Cost: 3 to 7 microseconds and about 1 kB a triangle
    static Result<Compound> from_triangles(std::span<const Eigen::Vector3d> vertices,
                                           std::span<const std::array<std::uint32_t, 3>> triangles);

    // Moving copies, so that no compound is ever without its data.
    Compound(const Compound&) = default;
    Compound& operator=(const Compound&) = default;

    std::span<const CompoundPart> parts() const;

    /// Of every part, in the same order.
    std::span<const Aabb> bounds() const;

private:
    explicit Compound(std::shared_ptr<const internal::CompoundData> data);
    friend const internal::CompoundData& internal::compound_data(const Compound& compound);
    friend double bounding_radius(const Compound& compound);
    friend double smallest_half_extent(const Compound& compound);

    std::shared_ptr<const internal::CompoundData> data_;
};

/// Never fails: what create() made is good.
Result<void> check(const Compound& compound);

/// Largest distance of a point of any part from the body's origin, metres.
double bounding_radius(const Compound& compound);

/// The smallest of its parts', metres, because a tolerance must suit the thinnest; 0 for triangles.
double smallest_half_extent(const Compound& compound);

/// Distance that the farthest part reaches from the body's origin in a unit direction of the body
/// frame, metres; negative where all of them lie behind the origin.
///
/// Cost: linear in the parts
double support_distance(const Compound& compound, const Eigen::Vector3d& direction_body);

}  // namespace terrane
