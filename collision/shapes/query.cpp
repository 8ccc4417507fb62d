// SPDX-License-Identifier: MIT
//
// Rotation matrices from and to rotation vectors, without the C library's trigonometric functions.
//
// Sources:    O. Rodrigues. Des lois geometriques... 1840 (the rotation formula).
//             S. W. Shepperd. Quaternion from rotation matrix. J. Guidance and Control 1978 (rotation vectors).
//             W. J. Cody, W. Waite. Software manual for the elementary functions. 1980, chapter 8 (range reduction).
// Deviations: sine, cosine and arc tangent are Taylor sums over a small range instead of minimax polynomials: they need
//             a few more terms, but every coefficient can be verified by inspection.
#include "base/vector_math.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/lattice.h>

#include <cmath>

namespace terrane {
namespace {

using internal::cross;
using internal::dot;
using internal::product;

struct SineCosine {
    double sine = 0.0;
    double cosine = 1.0;
};

// Sum over k of (-xx)^k / (2k + Odd)!; with xx = x^2 this is cos(x) for Odd = 0 and sin(x) / x for Odd = 1.
template <int Terms, int Odd>
double alternating_sum(double xx) {
    double sum = 1.0;
    for (int k = Terms; k >= 1; --k) {
        const double share = 1.0 / ((2.0 * k) * (2.0 * k + 2.0 * Odd - 1.0));
        sum = 1.0 - sum * (xx * share);
    }
    return sum;
}

// Error below 3e-16 for angles below 1e5; for larger angles the rounding of the products costs digits.
SineCosine compute_sine_cosine(double angle) {
    // pi / 2 in three parts: multiples up to 2^20 of the first two are exact.
    constexpr double kHigh = 0x1.921fb544p+0;
    constexpr double kMiddle = 0x1.0b4611a6p-34;
    constexpr double kLow = 0x1.3198a2e037073p-69;
    const double quarter = std::floor(angle * 0.63661977236758134308 + 0.5);
    const double x = ((angle - quarter * kHigh) - quarter * kMiddle) - quarter * kLow;
    const double xx = x * x;
    const double sine = x * alternating_sum<9, 1>(xx);
    const double cosine = alternating_sum<10, 0>(xx);
    const double turns = quarter - 4.0 * std::floor(quarter * 0.25);
    if (turns == 1.0) return {cosine, -sine};
    if (turns == 2.0) return {-sine, -cosine};
    if (turns == 3.0) return {-cosine, sine};
    return {sine, cosine};
}

// atan(y / x) for x, y >= 0, not both 0.
double compute_arc_tangent(double y, double x) {
    constexpr double kHalfPi = 1.57079632679489661923;
    if (y > x) return kHalfPi - compute_arc_tangent(x, y);
    double t = y / x;
    // Halving the angle three times leaves t <= tan(pi / 32) < 0.1.
    for (int i = 0; i < 3; ++i) t = t / (1.0 + std::sqrt(1.0 + t * t));
    const double tt = t * t;
    double sum = 0.0;
    for (int k = 10; k >= 0; --k) sum = 1.0 / (2.0 * k + 1.0) - tt * sum;
    return 8.0 * t * sum;
}

Eigen::Vector3d normalized(const Eigen::Vector3d& v) {
    const double excess = dot(v, v) - 1.0;
    // One Newton step: its error, 3/8 of the excess squared, is below rounding here.
    if (std::abs(excess) < 1e-8) return v * (1.0 - 0.5 * excess);
    return v / internal::length(v);
}

Eigen::Matrix3d make_rotation(const Eigen::Vector3d& axis, double angle) {
    // Uses the half angle, so that 1 - cos has no cancellation.
    const SineCosine half = compute_sine_cosine(0.5 * angle);
    const double sine = 2.0 * half.sine * half.cosine;
    const double versine = 2.0 * half.sine * half.sine;
    const double cosine = 1.0 - versine;
    Eigen::Matrix3d r;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            r(row, column) = versine * axis[row] * axis[column];
        }
        r(row, row) += cosine;
    }
    r(0, 1) -= sine * axis[2];
    r(1, 0) += sine * axis[2];
    r(0, 2) += sine * axis[1];
    r(2, 0) -= sine * axis[1];
    r(1, 2) -= sine * axis[0];
    r(2, 1) += sine * axis[0];
    return r;
}

}  // namespace

Pose Motion::at(double t) const {
    Pose pose = start;
    if (t == 0.0) return pose;
    pose.translation = start.translation + t * translation;
    const double angle = internal::length(rotation_vector);
    if (angle == 0.0) return pose;
    const Eigen::Vector3d axis = rotation_vector / angle;
    pose.rotation = orthonormalized(product(make_rotation(axis, t * angle), start.rotation));
    return pose;
}

Eigen::Vector3d rotation_vector_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
    const Eigen::Matrix3d r = product(to, from.transpose());
    // Starts from the quaternion's largest component to avoid cancellation.
    const double trace = r(0, 0) + r(1, 1) + r(2, 2);
    double w = 0.0;
    Eigen::Vector3d v = Eigen::Vector3d::Zero();
    if (trace > 0.0) {
        w = 1.0 + trace;
        v = {r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
    } else {
        int i = 0;
        if (r(1, 1) > r(0, 0)) i = 1;
        if (r(2, 2) > r(i, i)) i = 2;
        const int j = (i + 1) % 3;
        const int k = (i + 2) % 3;
        v[i] = 1.0 + r(i, i) - r(j, j) - r(k, k);
        v[j] = r(i, j) + r(j, i);
        v[k] = r(i, k) + r(k, i);
        w = r(k, j) - r(j, k);
    }
    const double norm = internal::length(v);
    if (norm == 0.0) return Eigen::Vector3d::Zero();
    const double angle = 2.0 * compute_arc_tangent(norm, std::abs(w));
    return v * ((w < 0.0 ? -angle : angle) / norm);
}

Eigen::Matrix3d orthonormalized(const Eigen::Matrix3d& rotation) {
    const Eigen::Vector3d x = normalized(rotation.col(0));
    Eigen::Vector3d y = rotation.col(1);
    y -= dot(x, y) * x;
    y = normalized(y);
    Eigen::Matrix3d result;
    result.col(0) = x;
    result.col(1) = y;
    result.col(2) = cross(x, y);
    return result;
}

}  // namespace terrane

namespace terrane::internal {
namespace {

/// False for NaN.
bool is_within(const Eigen::Vector3d& value, double limit) {
    return std::abs(value[0]) <= limit && std::abs(value[1]) <= limit &&
           std::abs(value[2]) <= limit;
}

}  // namespace

bool is_valid_place(const WorldPos& point_world) { return is_within(point_world, kFarthestPlace); }

bool is_valid_query(const Shape& shape, const Pose& pose) {
    constexpr double kOrthonormal = 1e-6;
    if (!validate(shape) || !is_valid_place(pose.translation)) return false;
    const Eigen::Matrix3d& m = pose.rotation;
    return is_finite(m.col(0)) && is_finite(m.col(1)) && is_finite(m.col(2)) &&
           column_error(m) <= kOrthonormal && determinant(m) > 0.0;
}

bool is_valid_query(const Shape& shape, const Motion& motion) {
    return is_valid_query(shape, motion.start) && is_valid_place(motion.translation) &&
           is_within(motion.rotation_vector, kMostRotation);
}

bool is_resolved(const Motion& motion, double tolerance) {
    // Neighbouring doubles at x are at most 2^-52 x apart.
    const double limit = 0x1p50 * tolerance;
    return is_within(motion.start.translation, limit) &&
           is_within(motion.start.translation + motion.translation, limit);
}

}  // namespace terrane::internal
