// SPDX-License-Identifier: MIT
#include "pairs/compound/compound_ray.h"

#include "base/vector_math.h"

namespace terrane::internal {

PartRay cast_ray(const PlacedShape& shape, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& displacement) {
    PartRay best;
    if (shape.view->is_single()) {
        static_cast<ConvexRay&>(best) = cast_ray(shape.part(0), from, displacement);
        return best;
    }
    const Eigen::Vector3d start = rotated_back(shape.rotation, from - shape.centre);
    const Eigen::Vector3d displacement_body = rotated_back(shape.rotation, displacement);
    // Rounding, and the distance that counts as touching.
    const double slack = 2.0 * kTouchShare * shape.view->reach() +
                         1e-15 * (length(start) + length(displacement_body));
    visit_leaves_up_to(
        shape.view->tree(), 1.0,
        [&](const Aabb& box) { return segment_entry(start, displacement_body, box, slack); },
        [&](std::uint32_t part) {
            const ConvexRay ray = cast_ray(shape.part(part), from, displacement);
            const bool is_tie = best.hit && ray.fraction == best.fraction && part < best.part;
            if (ray.hit && (!best.hit || ray.fraction < best.fraction || is_tie)) {
                static_cast<ConvexRay&>(best) = ray;
                best.part = part;
            }
            return best.hit ? best.fraction : 1.0;
        });
    return best;
}

}  // namespace terrane::internal
