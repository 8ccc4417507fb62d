// SPDX-License-Identifier: MIT
#include "objects/continuous_levels.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

namespace terrane::test::near_objects {
namespace {

using internal::NearObject;
using internal::NearObjects;
using internal::ObjectKey;

std::set<ObjectKey> select(NearObjects& near, const std::map<ObjectKey, float>& candidates) {
    near.clear();
    std::size_t place = 0;
    for (const auto& [key, factor] : candidates)
        near.add({.key = key, .model = 0, .place = place++, .log2_factor = factor});
    near.select();
    std::set<ObjectKey> keys;
    std::size_t least_place = 0;
    for (const NearObject& object : near.objects()) {
        EXPECT_GE(object.place, least_place) << "in the order of places";
        least_place = object.place + 1;
        EXPECT_EQ(candidates.at(object.key), object.log2_factor);
        keys.insert(object.key);
    }
    return keys;
}

TEST(NearObjects, AreTheNearestOfRandomCandidatesAndThoseThatStay) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const auto most = static_cast<std::size_t>(1 + random.below(20));
        NearObjects near(most);
        std::set<ObjectKey> before;
        for (int frame = 0; frame < 30; ++frame) {
            std::map<ObjectKey, float> candidates;
            for (int i = random.below(60); i > 0; --i) {
                // with ties
                candidates[{static_cast<std::uint64_t>(random.below(8)),
                            static_cast<std::uint32_t>(random.below(8))}] =
                    0.25f * static_cast<float>(random.below(20));
            }
            // slowly: sort all
            std::vector<std::pair<float, ObjectKey>> ranked;
            for (const auto& [key, factor] : candidates)
                ranked.emplace_back(before.contains(key) ? -factor - 0.169925f : -factor, key);
            std::sort(ranked.begin(), ranked.end());
            ranked.resize(std::min(ranked.size(), most));
            std::set<ObjectKey> expected;
            for (const auto& [nearness, key] : ranked) expected.insert(key);
            before = select(near, candidates);
            ASSERT_EQ(before, expected);
        }
    }
}

TEST(NearObjects, DoNotTakeTurnsWhileTheyAreNearlyEqual) {
    NearObjects near(1);
    const ObjectKey first = {1, 0}, second = {1, 1};
    EXPECT_EQ(select(near, {{first, 3.0f}, {second, 2.9f}}), std::set{first});
    for (int frame = 0; frame < 10; ++frame) {
        const float apart = frame % 2 == 0 ? 0.15f : -0.15f;  // a tenth
        EXPECT_EQ(select(near, {{first, 3.0f}, {second, 3.0f + apart}}), std::set{first});
    }
    EXPECT_EQ(select(near, {{first, 3.0f}, {second, 3.2f}}), std::set{second});
    EXPECT_EQ(select(near, {{first, 3.1f}, {second, 3.0f}}), std::set{second});
}

TEST(NearObjects, AreAllWhereThatManyMayBeAndTheFirstWhereAllAreEqual) {
    NearObjects all(std::numeric_limits<std::size_t>::max());
    EXPECT_TRUE(select(all, {}).empty());
    EXPECT_EQ(select(all, {{{1, 0}, 1.0f}, {{1, 5}, 1.0f}, {{2, 0}, -3.0f}}).size(), 3u);
    NearObjects two(2);
    EXPECT_EQ(select(two, {{{4, 0}, 1.0f}, {{5, 5}, 1.0f}, {{6, 0}, 1.0f}}),
              (std::set<ObjectKey>{{4, 0}, {5, 5}}));
}

}  // namespace
}  // namespace terrane::test::near_objects
