// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_contact.h>
#include <terrane/collision/motion.h>

namespace terrane {

/// The first contact of a cast.
struct CastAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;  ///< whether the ground is met
    double fraction = 1.0;            ///< of the motion; up to it the shape is not in the ground
    bool started_in_contact = false;  ///< touch or overlap at t = 0: fraction is 0
    Contact contact;                  ///< deepest at `fraction`
    double error_m = 0.0;
};

/// First time of contact of a moving, turning shape with the ground.
///
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      O(cells near the path), not of the whole sweep's box
CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings = {});

}  // namespace terrane
