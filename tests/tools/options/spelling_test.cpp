// SPDX-License-Identifier: MIT
#include "program/command.h"

#include <gtest/gtest.h>

#include <vector>

namespace terrane::tools {
namespace spelling_test {

TEST(SpellingDistance, CountsInsertionsRemovalsReplacementsAndSwaps) {
    EXPECT_EQ(spelling_distance("", ""), 0u);
    EXPECT_EQ(spelling_distance("", "abc"), 3u);
    EXPECT_EQ(spelling_distance("budget", "budget"), 0u);
    EXPECT_EQ(spelling_distance("bugdet", "budget"), 1u) << "neighbours that are swapped";
    EXPECT_EQ(spelling_distance("budge", "budget"), 1u);
    EXPECT_EQ(spelling_distance("bbudget", "budget"), 1u);
    EXPECT_EQ(spelling_distance("badget", "budget"), 1u);
    EXPECT_EQ(spelling_distance("abc", "xyz"), 3u);
}

TEST(NearestWord, IsTheNearestOrNone) {
    const std::vector<std::string> words{"--budget", "--seed", "--seconds", "--speed"};
    EXPECT_EQ(nearest_word("--bugdet", words), "--budget");
    EXPECT_EQ(nearest_word("--second", words), "--seconds");
    EXPECT_EQ(nearest_word("--speeed", words), "--speed");
    EXPECT_EQ(nearest_word("--bu", words), "--budget") << "cut short";
    EXPECT_EQ(nearest_word("--xylophone", words), "");
    EXPECT_EQ(nearest_word("", words), "");
    EXPECT_EQ(nearest_word(std::string(100'000, 'x'), words), "");
    EXPECT_EQ(nearest_word("--seed", {}), "");
    EXPECT_EQ(did_you_mean("--sed", words), "; did you mean --seed?");
    EXPECT_EQ(did_you_mean("--other", words), "");
}

}  // namespace spelling_test
}  // namespace terrane::tools
