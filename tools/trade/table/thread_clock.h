// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::tools {

/// Processor time of the calling thread, seconds: other programs on the machine do not lengthen it. For what runs on
/// this thread alone.
double thread_seconds();

}  // namespace terrane::tools
