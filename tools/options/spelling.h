// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace terrane::tools {

/// Edit distance: fewest insertions, removals, replacements and swaps of adjacent letters that turn one word into the
/// other.
std::size_t spelling_distance(std::string_view a, std::string_view b);

/// The nearest of some words, at an edit distance of at most a third of the letters, rounded up; else one that `word`
/// is a prefix of, with four letters or more. Ties go to the first; "" where there is none.
std::string nearest_word(std::string_view word, std::span<const std::string> words);

/// "; did you mean X?", or "" where no word is near.
std::string did_you_mean(std::string_view word, std::span<const std::string> words);

}  // namespace terrane::tools
