// SPDX-License-Identifier: MIT
#include "raster/opening_progress.h"

#include <algorithm>

namespace terrane::internal {

void OpeningProgress::begin(double end, std::int64_t steps) {
    const std::lock_guard lock(mutex_);
    from_ = to_;
    to_ = end;
    done_ = 0;
    steps_ = std::max<std::int64_t>(steps, 1);
}

Result<void> OpeningProgress::step() {
    const std::lock_guard lock(mutex_);
    done_ = std::min(done_ + 1, steps_);
    if (report_ && !cancelled_) {
        const double share = static_cast<double>(done_) / static_cast<double>(steps_);
        cancelled_ = !report_(from_ + (to_ - from_) * share);
    }
    if (cancelled_) {
        return fail(ErrorCode::cancelled, "opening raster \"" + path_ + "\" was cancelled");
    }
    return {};
}

}  // namespace terrane::internal
