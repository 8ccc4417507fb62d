// SPDX-License-Identifier: MIT
#include "paging/demand/need.h"

namespace terrane::internal {

bool has_priority_over(const LoadCandidate& a, const LoadCandidate& b) {
    if (a.need.why != b.need.why) return a.need.why < b.need.why;
    const bool is_late_a = a.slack_s <= 0.0;
    const bool is_late_b = b.slack_s <= 0.0;
    if (is_late_a != is_late_b) return is_late_a;
    if (is_late_a && a.need.ratio != b.need.ratio) return a.need.ratio > b.need.ratio;
    if (a.slack_s != b.slack_s) return a.slack_s < b.slack_s;
    if (a.key.level != b.key.level) return a.key.level < b.key.level;
    return a.key < b.key;
}

}  // namespace terrane::internal
