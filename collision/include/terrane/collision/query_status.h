// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// How complete an answer is. Physics must not run on `not_resident`.
enum class QueryStatus {
    complete,      ///< everything was answered; ground that is outside the extent is no ground
    truncated,     ///< contacts_out was too small: the deepest ones were kept
    not_resident,  ///< part of the ground that decides is not loaded
    invalid,       ///< shape or pose is not finite, out of range, or the rotation not orthonormal
};

/// Whether a shape touches something.
struct TestAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool is_touching = false;  ///< touch or overlap
    double error_m = 0.0;  ///< largest bound of the cells that were evaluated
};

/// A measure with the sign of the signed distance, which costs less.
struct PseudodistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double pseudodistance = 0.0;                        ///< metres
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< moving apart along it adds to it
    double error_m = 0.0;
};

}  // namespace terrane
