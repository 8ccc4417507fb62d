// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_contact.h>
#include <terrane/collision/motion.h>

namespace terrane {

/// Answer of cast().
struct CastAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether the ground is met
    double fraction = 1.0;                      ///< of the motion, in [0, 1]: no overlap before it
    bool started_in_contact = false;  ///< touch or overlap at t = 0; fraction is 0 unless skipped
    Contact contact;                  ///< the deepest at `fraction`; set where `hit`
    double error_m = 0.0;             ///< largest error_m of the cells tested
};

/// Time of impact: the first contact of a moving, turning shape with the ground; beside volumes with the joined solid,
/// ceilings and walls included.
///
/// Fails:     status `invalid` where an argument is out of range; `not_resident` where ground that is not loaded may be
///            met first: `fraction` is how far the motion is known to be clear
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      O(cells near the trajectory), not of the AABB of the whole sweep
CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings = {});

}  // namespace terrane
