// SPDX-License-Identifier: MIT
// Source: D. Luebke et al. Level of Detail for 3D Graphics. 2003, sections 4.1 to 4.4 (switches by distance and by
//         error, hysteresis, fades).
#include "graph/level_switch.h"

#include "levels/log_scale.h"

#include <algorithm>

namespace terrane::internal {

SwitchChoice choose_level(const SwitchNode& levels, double distance, double factor,
                          double threshold_px, std::size_t before) {
    SwitchChoice choice;
    for (std::size_t i = 0; i < levels.limits.size(); ++i) {
        // By which ratio the limit is passed: not increasing in i.
        const double limit = levels.limits[i];
        const double passed = levels.by == SwitchNode::By::distance
                                  ? distance / limit
                                  : threshold_px / (limit * factor);
        const double wanted = before > i ? 1.0 / levels.hysteresis : levels.hysteresis;
        if (!(passed >= wanted)) break;
        if (levels.fade_ratio > 1.0 && passed < levels.fade_ratio) {
            const float share = 1.0f - log2_of(static_cast<float>(passed)) /
                                           log2_of(static_cast<float>(levels.fade_ratio));
            // A share of 0 and of 1 would draw one of the two without pixels.
            return {i, true, std::clamp(share, 0x1p-10f, 1.0f - 0x1p-10f)};
        }
        choice.level = i + 1;
    }
    return choice;
}

}  // namespace terrane::internal
