// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// How complete an answer is. An answer that is `not_resident` must not be used to move a body.
enum class QueryStatus {
    complete,  ///< the answer is complete; cells outside the extent count as no ground
    truncated,  ///< the caller's buffer was too small: it has the deepest contacts, or the lowest indices
    not_resident,  ///< ground that the answer depends on is not loaded
    invalid,       ///< an argument is not finite or out of range, or a rotation is not orthonormal
};

/// Answer of test_contact(): whether a shape touches the ground or another shape.
struct TestAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool is_touching = false;                   ///< touch or overlap
    double error_m = 0.0;  ///< largest error_m of the cells tested, metres; 0 between shapes
};

/// Answer of pseudodistance(): a measure with the sign of the signed distance that costs less.
struct PseudodistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double pseudodistance = 0.0;                ///< metres
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit; moving along it increases the measure
    double error_m = 0.0;          ///< as in TestAnswer
};

}  // namespace terrane
