// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::tools {

/// Runs a fixed computation on this thread and returns its processor time, seconds; about a millisecond on a processor
/// of 2020. Half of it is a chain of integer hashes over a table of 256 KiB, half a chain of double-precision products
/// and sums: no library function and no vector width is part of it. So times over that of the loop in the same run can
/// be compared between machines, and between versions of the library.
double time_reference_loop();

}  // namespace terrane::tools
