// SPDX-License-Identifier: MIT
//
// Sources:
//   F. J. Damerau. A technique for computer detection and correction of spelling errors. Communications of the ACM
//   7(3), 1964 (optimal string alignment: no letter is edited twice).
#include "options/spelling.h"

#include <algorithm>
#include <vector>

namespace terrane::tools {

std::size_t spelling_distance(std::string_view a, std::string_view b) {
    // costs[i][j]: of the first i letters of a and the first j of b
    std::vector<std::vector<std::size_t>> costs(a.size() + 1,
                                                std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) {
        for (std::size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                costs[i][j] = i + j;
                continue;
            }
            const std::size_t replaced = costs[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            std::size_t least = std::min({replaced, costs[i - 1][j] + 1, costs[i][j - 1] + 1});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                least = std::min(least, costs[i - 2][j - 2] + 1);
            }
            costs[i][j] = least;
        }
    }
    return costs[a.size()][b.size()];
}

std::string nearest_word(std::string_view word, std::span<const std::string> words) {
    constexpr std::size_t kLongest = 100;  // no flag is longer
    if (word.size() > kLongest) return "";
    std::string nearest;
    std::size_t least = (word.size() + 2) / 3 + 1;
    for (const std::string& each : words) {
        const std::size_t distance = spelling_distance(word, each);
        if (distance >= least) continue;
        least = distance;
        nearest = each;
    }
    if (!nearest.empty() || word.size() < 4) return nearest;
    const auto longer = std::find_if(words.begin(), words.end(), [word](const std::string& each) {
        return each.starts_with(word);
    });
    return longer == words.end() ? "" : *longer;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> words) {
    const std::string nearest = nearest_word(word, words);
    return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

}  // namespace terrane::tools
