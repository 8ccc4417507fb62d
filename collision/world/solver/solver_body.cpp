// SPDX-License-Identifier: MIT
//
// Sources:    Blow, Binstock. How to find the inertia tensor (or other mass properties) of a 3D solid body
//             represented by a triangle mesh. 2004 (sums over tetrahedra).
//             Chan, Golub, LeVeque. Updating formulae and a pairwise algorithm for computing sample variances.
//             1979 (sums about moving centres, without cancellation).
//             Golub, Van Loan. Matrix Computations. Section 8.5 (Jacobi's rotations).
// Deviations: one formula for simplices of any dimension, so that plates, rods and points also have mass.
#include "world/solver/solver_body.h"

#include "base/vector_math.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace terrane::internal {
namespace {

/// Relative size below which an offset or an off-diagonal moment is treated as rounding.
constexpr double kRounding = 1e-12;

bool is_identity(const Pose& pose) {
    return pose.translation.isZero(0.0) && pose.rotation.isIdentity(0.0);
}

double trace(const Eigen::Matrix3d& m) { return m(0, 0) + m(1, 1) + m(2, 2); }

void add_square(Eigen::Matrix3d& sum, double weight, const Eigen::Vector3d& v) {
    for (int column = 0; column < 3; ++column) sum.col(column) += (weight * v[column]) * v;
}

/// Moments of order 0, 1 and 2 of a set of uniform density.
struct Moments {
    int dimension = -1;    ///< 3 solid, 2 area, 1 length, 0 points
    double content = 0.0;  ///< volume, area, length or count: m^dimension
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();  ///< integral of d d^T, d from the centre

    /// Adds a set. Of two sets of different dimension, the one of lower dimension has no content.
    void add(const Moments& other) {
        if (other.dimension < dimension || !(other.content > 0.0)) return;
        if (other.dimension > dimension) {
            *this = other;
            return;
        }
        const double both = content + other.content;
        const double share = other.content / both;
        const Eigen::Vector3d displacement = other.centre - centre;
        add_square(spread, content * share, displacement);
        spread += other.spread;
        centre += share * displacement;
        content = both;
    }
};

/// Moments of a simplex: a point, segment, triangle or tetrahedron.
template <std::size_t N>
Moments simplex_moments(const std::array<Eigen::Vector3d, N>& v, double content) {
    Moments moments{.dimension = static_cast<int>(N) - 1, .content = content};
    for (const Eigen::Vector3d& point : v) moments.centre += point;
    moments.centre /= static_cast<double>(N);
    for (const Eigen::Vector3d& point : v) {
        add_square(moments.spread, content / static_cast<double>(N * (N + 1)),
                   point - moments.centre);
    }
    return moments;
}

Moments moments_of(const ConvexHull& hull) {
    const Polyhedron& shape = polyhedron(hull);
    const Eigen::Vector3d& apex = shape.vertices[0];
    const bool is_solid = shape.faces.size() > 2;
    Moments sum;
    for (const Eigen::Vector3d& vertex : shape.vertices) {
        sum.add(simplex_moments(std::array{vertex}, 1.0));
    }
    if (shape.vertices.size() == 2) {
        const Eigen::Vector3d& end = shape.vertices[1];
        sum.add(simplex_moments(std::array{apex, end}, length(end - apex)));
    }
    // A flat hull has two faces back to back: counting the area twice does not change ratios.
    for (const Polyhedron::Face& face : shape.faces) {
        const auto at = [&](std::uint32_t i) -> const Eigen::Vector3d& {
            return shape.vertices[shape.loops[face.first + i]];
        };
        for (std::uint32_t i = 2; i < face.count; ++i) {
            const std::array triangle{at(0), at(i - 1), at(i)};
            const Eigen::Vector3d area =
                0.5 * cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
            if (!is_solid) {
                sum.add(simplex_moments(triangle, length(area)));
                continue;
            }
            const double volume = dot(area, triangle[0] - apex) / 3.0;
            sum.add(
                simplex_moments(std::array{apex, triangle[0], triangle[1], triangle[2]}, volume));
        }
    }
    return sum;
}

Eigen::Vector3d inertia_of(const Sphere& sphere, double mass) {
    return Eigen::Vector3d::Constant(0.4 * mass * sphere.radius * sphere.radius);
}

Eigen::Vector3d inertia_of(const Capsule& capsule, double mass) {
    // Volumes divided by pi r^2, of a cylinder of length 2 h and of a sphere cut in two caps.
    const double r = capsule.radius, h = capsule.half_height;
    const double cylinder = 2.0 * h, caps = 4.0 / 3.0 * r;
    const double density = cylinder + caps > 0.0 ? mass / (cylinder + caps) : 0.0;
    const double across = density * (cylinder * (0.25 * r * r + h * h / 3.0) +
                                     caps * (0.4 * r * r + h * h + 0.75 * h * r));
    return {across, across, density * (cylinder * 0.5 + caps * 0.4) * r * r};
}

Eigen::Vector3d inertia_of(const Box& box, double mass) {
    const Eigen::Vector3d& half = box.half_extents;
    const double xx = half.x() * half.x(), yy = half.y() * half.y(), zz = half.z() * half.z();
    return Eigen::Vector3d(yy + zz, xx + zz, xx + yy) * (mass / 3.0);
}

constexpr double kPi = 3.14159265358979323846;

/// Moments of which only dimension and content are set.
Moments content_of(const Sphere& sphere) {
    const double r = sphere.radius;
    if (!(r > 0.0)) return {.dimension = 0, .content = 1.0};
    return {.dimension = 3, .content = 4.0 / 3.0 * kPi * r * r * r};
}
Moments content_of(const Capsule& capsule) {
    const double r = capsule.radius, h = capsule.half_height;
    if (!(h > 0.0)) return content_of(Sphere{r});
    if (!(r > 0.0)) return {.dimension = 1, .content = 2.0 * h};
    return {.dimension = 3, .content = kPi * r * r * (2.0 * h + 4.0 / 3.0 * r)};
}
Moments content_of(const Box& box) {
    Moments moments{.dimension = 0, .content = 1.0};
    for (int axis = 0; axis < 3; ++axis) {
        if (!(box.half_extents[axis] > 0.0)) continue;
        ++moments.dimension;
        moments.content *= 2.0 * box.half_extents[axis];
    }
    return moments;
}

template <class Simple>
Moments moments_of(const Simple& shape) {
    Moments moments = content_of(shape);
    const Eigen::Vector3d inertia = inertia_of(shape, moments.content);
    for (int axis = 0; axis < 3; ++axis) {
        moments.spread(axis, axis) =
            0.5 * (inertia.x() + inertia.y() + inertia.z()) - inertia[axis];
    }
    return moments;
}

Moments moments_of(const Compound& compound) {
    Moments sum;
    for (const CompoundPart& part : compound.parts()) {
        Moments moments = std::visit([](const auto& each) { return moments_of(each); }, part.shape);
        const Eigen::Matrix3d rotation = orthonormalized(part.body_from_part.rotation);
        const Eigen::Matrix3d back = rotation.transpose();
        moments.centre = rotated(rotation, moments.centre) + part.body_from_part.translation;
        moments.spread = product(product(rotation, moments.spread), back);
        sum.add(moments);
    }
    return sum;
}

/// Eigenvectors of a symmetric matrix by Jacobi's method, as the columns of a rotation.
Eigen::Matrix3d find_axes(Eigen::Matrix3d m) {
    constexpr int kMaxSweeps = 30;  // convergence is quadratic: four or five sweeps are usual
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    const double negligible = kRounding * trace(m);
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
        bool turned = false;
        for (int p = 0; p < 2; ++p) {
            for (int q = p + 1; q < 3; ++q) {
                if (!(std::abs(m(p, q)) > negligible)) continue;
                turned = true;
                const double theta = 0.5 * (m(q, q) - m(p, p)) / m(p, q);
                const double tangent =
                    std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(1.0 + theta * theta));
                const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
                const double sine = tangent * cosine;
                Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
                turn(p, p) = turn(q, q) = cosine;
                turn(p, q) = sine;
                turn(q, p) = -sine;
                const Eigen::Matrix3d back = turn.transpose();
                m = product(back, product(m, turn));
                axes = product(axes, turn);
            }
        }
        if (!turned) break;
    }
    return axes;
}

Result<Shape> moved(const ConvexHull& hull, const Pose& body_from_centred) {
    std::vector<Eigen::Vector3d> points(hull.vertices().begin(), hull.vertices().end());
    for (Eigen::Vector3d& point : points) {
        point = rotated_back(body_from_centred.rotation, point - body_from_centred.translation);
    }
    return ConvexHull::create(points).map([](ConvexHull&& made) { return Shape(made); });
}

Result<Shape> moved(const Compound& compound, const Pose& body_from_centred) {
    const Eigen::Matrix3d back = body_from_centred.rotation.transpose();
    std::vector<CompoundPart> parts(compound.parts().begin(), compound.parts().end());
    for (CompoundPart& part : parts) {
        Pose& pose = part.body_from_part;
        pose.rotation = product(back, orthonormalized(pose.rotation));
        pose.translation = rotated(back, pose.translation - body_from_centred.translation);
    }
    return Compound::create(parts).map([](Compound&& made) { return Shape(made); });
}

template <class Made>
Result<CentredShape> centred(const Made& shape) {
    const Moments moments = moments_of(shape);
    const double negligible = kRounding * bounding_radius(shape);
    CentredShape answer{shape, {}};
    Pose& frame = answer.body_from_centred;
    frame.rotation = find_axes(moments.spread);
    if (length(moments.centre) > negligible) frame.translation = moments.centre;
    if (is_identity(frame)) return answer;
    TERRANE_TRY(Shape there, moved(shape, frame));
    answer.shape = std::move(there);
    return answer;
}

/// Principal moments of inertia of a centred shape, kg m^2.
template <class Made>
Eigen::Vector3d inertia_of(const Made& shape, double mass) {
    const Moments moments = moments_of(shape);
    const double density = mass / moments.content;
    const Eigen::Vector3d& c = moments.centre;
    Eigen::Vector3d inertia;
    for (int axis = 0; axis < 3; ++axis) {
        inertia[axis] = density * (trace(moments.spread) - moments.spread(axis, axis)) +
                        mass * (dot(c, c) - c[axis] * c[axis]);
        // A rod has no inertia about its own axis: a remainder is rounding.
        if (inertia[axis] <= kRounding * density * trace(moments.spread)) inertia[axis] = 0.0;
    }
    return inertia;
}

}  // namespace

MassProperties make_mass_properties(const Shape& shape, double mass) {
    MassProperties properties;
    properties.inverse_mass = 1.0 / mass;
    properties.inertia =
        std::visit([&](const auto& each) { return inertia_of(each, mass); }, shape);
    for (int axis = 0; axis < 3; ++axis) {
        const double inertia = properties.inertia[axis];
        properties.inverse_inertia[axis] = inertia > 1e-30 ? 1.0 / inertia : 0.0;
    }
    return properties;
}

Result<CentredShape> make_centred(const Shape& shape) {
    if (const auto* hull = std::get_if<ConvexHull>(&shape)) return centred(*hull);
    if (const auto* compound = std::get_if<Compound>(&shape)) return centred(*compound);
    return CentredShape{shape, {}};
}

Pose to_centred(const Pose& world_from_body, const Pose& body_from_centred) {
    if (is_identity(body_from_centred)) return world_from_body;
    const Eigen::Vector3d arm = rotated(world_from_body.rotation, body_from_centred.translation);
    return {product(world_from_body.rotation, body_from_centred.rotation),
            world_from_body.translation + arm};
}

Pose from_centred(const Pose& world_from_centred, const Pose& body_from_centred) {
    if (is_identity(body_from_centred)) return world_from_centred;
    const Eigen::Matrix3d back = body_from_centred.rotation.transpose();
    const Eigen::Matrix3d rotation = product(world_from_centred.rotation, back);
    const Eigen::Vector3d arm = rotated(rotation, body_from_centred.translation);
    return {rotation, world_from_centred.translation - arm};
}

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity) {
    return 0.5 *
           (dot(velocity.linear, velocity.linear) / mass.inverse_mass +
            dot(velocity.angular, apply_tensor(pose.rotation, mass.inertia, velocity.angular)));
}

void SolverBody::set(const MassProperties& mass, const Pose& pose, const Twist& start_velocity) {
    change_ = {};
    level_ = 0;
    root_inverse_mass_ = std::sqrt(mass.inverse_mass);
    for (int axis = 0; axis < 3; ++axis) {
        root_inverse_inertia_[axis] = std::sqrt(mass.inverse_inertia[axis]);
    }
    velocity = start_velocity;
    mass_ = mass;
    pose_ = pose;
}

void SolverBody::set_fixed(const Pose& pose, const Twist& constant_velocity) {
    set({.inverse_mass = 0.0}, pose, constant_velocity);
}

Vector6 SolverBody::scaled(const Eigen::Vector3d& force, const Eigen::Vector3d& moment) const {
    const Eigen::Vector3d linear = root_inverse_mass_ * force;
    const Eigen::Vector3d moment_body = rotated_back(pose_.rotation, moment);
    const Eigen::Vector3d& root = root_inverse_inertia_;
    Vector6 result;
    result.pairs[0] = Vector6::Pair{linear[0], linear[1]};
    result.pairs[1] = Vector6::Pair{linear[2], root[0] * moment_body[0]};
    result.pairs[2] = Vector6::Pair{root[1] * moment_body[1], root[2] * moment_body[2]};
    return result;
}

Twist SolverBody::unscaled(const Vector6& change) const {
    const Vector6::Pair* const c = change.pairs;
    const Eigen::Vector3d& root = root_inverse_inertia_;
    const Eigen::Vector3d linear(c[0][0], c[0][1], c[1][0]);
    const Eigen::Vector3d angular_body(root[0] * c[1][1], root[1] * c[2][0], root[2] * c[2][1]);
    return {root_inverse_mass_ * linear, rotated(pose_.rotation, angular_body)};
}

}  // namespace terrane::internal
