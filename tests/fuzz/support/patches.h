// SPDX-License-Identifier: MIT
#pragma once

#include "support/input.h"

#include <cstdint>
#include <vector>

namespace terrane::fuzz {

/// A file as an input describes it: a valid file with changes. So the corpus stays small, and stays valid when a format
/// of ours changes, because the target makes the valid file itself.
///
/// The rest of the input is a list of changes: a byte that says which, an offset of 16 bits (modulo the size), a length
/// of a byte where one is needed, and the bytes that are written. Changes overwrite, insert, erase, cut off the end or
/// repeat a range.
std::vector<std::uint8_t> patched(std::vector<std::uint8_t> file, Input& input);

}  // namespace terrane::fuzz
