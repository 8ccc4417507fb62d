// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <string>

namespace terrane::internal {

/// Messages of the debug output of a context since the last check.
struct GlLog {
    std::string first;  ///< first error or high-severity message; empty: none
    int count = 0;
};

/// Redirects the debug output of the current context to a log, which must outlive the context.
void attach_log(GlLog& log);

/// Fails with device_unavailable where the current context has an error, or its log a message, and clears both.
///
/// @param doing the operation, for the message: "draw the terrain"
Result<void> check_gl(const std::string& doing);

}  // namespace terrane::internal
