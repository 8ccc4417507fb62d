// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "batch/array_checks.h"
#include "batch/ground_batch_state.h"

namespace terrane {

Result<GroundBatch> GroundBatch::create(const GroundBatchSettings& settings) {
    if (auto ok = check_range("worker_count", settings.worker_count, 1, 64); !ok) {
        return tl::unexpected(ok.error());
    }
    return GroundBatch(std::make_unique<State>(settings.worker_count));
}

GroundBatch::GroundBatch(std::unique_ptr<State> state) : state_(std::move(state)) {}
GroundBatch::GroundBatch(GroundBatch&&) noexcept = default;
GroundBatch& GroundBatch::operator=(GroundBatch&&) noexcept = default;
GroundBatch::~GroundBatch() = default;

}  // namespace terrane
