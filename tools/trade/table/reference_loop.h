// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::tools {

/// Runs a fixed computation on one thread and returns its processor time, seconds; about a millisecond on a processor of 2020.
/// Half of it is a chain of integer hashes over a table of 256 KiB, half a chain of double-precision products and sums:
/// no library function, no vector width and no thread is part of it. Times over that of the loop in the same run can
/// be compared between machines; between builds too, because the loop has no dependence on the library.
double time_reference_loop();

}  // namespace terrane::tools
