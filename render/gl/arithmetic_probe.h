// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

namespace terrane::internal {

/// Whether the current device rounds sums, products and conversions as the CPU does, in 4096 probes of each.
///
/// Fails with device_unavailable, naming the operation that differs
Result<void> probe_arithmetic();

}  // namespace terrane::internal
