// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace terrane::tools {

/// Fewest insertions, removals, replacements and swaps of neighbouring letters that make one word of the other.
std::size_t spelling_distance(std::string_view a, std::string_view b);

/// The word that another one was probably meant to be: at most a third of its letters, rounded up, are wrong; or, where
/// none is so near, it was cut short after four letters or more. The first of equally near ones; "" where there is none.
std::string nearest_word(std::string_view word, std::span<const std::string> words);

/// "; did you mean X?", or "" where no word is near.
std::string did_you_mean(std::string_view word, std::span<const std::string> words);

}  // namespace terrane::tools
