// SPDX-License-Identifier: MIT
#pragma once

#include "base/vector_math.h"

#include <terrane/collision/shapes.h>

#include <cstdint>

namespace terrane::internal {

/// Inverse mass of a body, and its moments of inertia about its principal axes, kg m^2. The inverse moment is 0 for an
/// axis on which all mass lies, such as that of a rod, and for bodies that do not rotate: impulses do not change this
/// spin. The inverse mass is 0 for a body of infinite mass.
struct MassProperties {
    double inverse_mass = 1.0;
    Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
    Eigen::Vector3d inverse_inertia = Eigen::Vector3d::Zero();
};

/// Mass properties of a centred shape (see make_centred()) of uniform density. Shapes without volume distribute their
/// mass over their area, shapes without area over their length. A compound is the sum of its parts: overlaps count
/// twice, and flat parts next to solid ones have no mass.
///
/// Cost: linear in the faces of a hull and in the parts of a compound
MassProperties make_mass_properties(const Shape& shape, double mass);

/// A shape whose origin is its centre of mass and whose axes are its principal axes.
struct CentredShape {
    Shape shape;
    Pose body_from_centred;  ///< identity if already centred: then the data is shared
};

/// Fails with invalid_argument if a hull or compound extends farther from its centre of mass than create() allows.
///
/// Allocates: a copy of a hull or compound that is not centred
Result<CentredShape> make_centred(const Shape& shape);

/// Converts between the poses of a body and of its centred shape; bit-identical if body_from_centred is the identity.
Pose to_centred(const Pose& world_from_body, const Pose& body_from_centred);
Pose from_centred(const Pose& world_from_centred, const Pose& body_from_centred);

/// Velocity or small displacement of a rigid body, linear at and angular about its centre of mass, world axes.
struct Twist {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity);

/// Six numbers in pairs, loaded and stored as whole pairs: a load that spans two stores would stall.
struct Vector6 {
    using Pair = double __attribute__((vector_size(16)));
    Pair pairs[3] = {};
};

/// Element-wise products, summed over the pairs.
inline Vector6::Pair products(const Vector6& a, const Vector6& b) {
    return a.pairs[0] * b.pairs[0] + a.pairs[1] * b.pairs[1] + a.pairs[2] * b.pairs[2];
}
inline double dot(const Vector6& a, const Vector6& b) {
    const Vector6::Pair sum = products(a, b);
    return sum[0] + sum[1];
}
inline void add_scaled(Vector6& to, const Vector6& a, double factor) {
    const Vector6::Pair factors{factor, factor};
    for (int i = 0; i < 3; ++i) to.pairs[i] += a.pairs[i] * factors;
}
inline void add_scaled(Vector6& to, const Vector6& a, double factor_a, const Vector6& b,
                       double factor_b) {
    const Vector6::Pair factors_a{factor_a, factor_a}, factors_b{factor_b, factor_b};
    for (int i = 0; i < 3; ++i) {
        to.pairs[i] += a.pairs[i] * factors_a + b.pairs[i] * factors_b;
    }
}
inline bool is_zero(const Vector6& a) { return dot(a, a) == 0.0; }

/// The solver's copy of a body. During a solve it stores the change of velocity scaled by the square root of the mass
/// matrix M: in coordinates of unit mass and inertia, with the angular part in body axes.
class alignas(64) SolverBody {
public:
    /// @param pose pose at which the contact points were computed
    void set(const MassProperties& mass, const Pose& pose, const Twist& start_velocity);
    /// Makes this a body of infinite mass.
    void set_fixed(const Pose& pose, const Twist& constant_velocity);

    const MassProperties& mass() const { return mass_; }
    const Pose& pose() const { return pose_; }
    bool is_fixed() const { return root_inverse_mass_ == 0.0; }

private:
    friend class ContactSolver;

    /// M^(-1/2) times a force and a moment; the transpose of unscaled().
    Vector6 scaled(const Eigen::Vector3d& force, const Eigen::Vector3d& moment) const;
    /// Converts a change in the solver's coordinates to a velocity.
    Twist unscaled(const Vector6& change) const;

    Vector6 change_;           // of the velocity since the start of the solve
    std::uint32_t level_ = 0;  // of the body's next contact, see ContactSolver::sort_by_level()
    double root_inverse_mass_ = 0.0;
    Eigen::Vector3d root_inverse_inertia_ = Eigen::Vector3d::Zero();  // body axes

public:
    Twist velocity;

private:
    MassProperties mass_;
    Pose pose_;
    Twist before_, plastic_;  // scratch of the solver
    // Conjugate directions: change_ after the last step, and the change of velocity by the direction's impulses.
    Vector6 step_start_, direction_;
};

}  // namespace terrane::internal
