// SPDX-License-Identifier: MIT
//
// ProgressiveMesh::share(): one record of contractions, levels of their own.
#include "support/meshes/objects.h"
#include "support/random.h"

#include <terrane/terrain/progressive_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

namespace terrane {
namespace shared_levels_test {

using Triangles = std::vector<TriangleMesh::Triangle>;

Triangles triangles_of(const ProgressiveMesh& mesh) {
    return {mesh.triangles().begin(), mesh.triangles().end()};
}

ProgressiveMesh make_rock(std::uint64_t seed) {
    return ProgressiveMesh::create(test::make_rock(3, seed)).value();
}

TEST(SharedLevels, StepsListTheErrorsAndCountsOfAllLevels) {
    ProgressiveMesh mesh = make_rock(1);
    const std::span<const double> errors = mesh.step_errors_m();
    const std::span<const std::uint32_t> counts = mesh.step_triangle_counts();
    ASSERT_EQ(errors.size(), counts.size());
    EXPECT_EQ(errors[0], 0.0);
    EXPECT_EQ(counts[0], mesh.finest().triangles.size());
    EXPECT_EQ(counts.back(), mesh.least_triangle_count());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        mesh.set_triangle_count(counts[i]);
        ASSERT_EQ(mesh.triangles().size(), counts[i]);
        ASSERT_EQ(mesh.error_m(), errors[i]);
    }
    EXPECT_TRUE(std::is_sorted(errors.begin(), errors.end()));
    const ProgressiveMesh none = ProgressiveMesh::create({}).value();
    EXPECT_EQ(none.step_errors_m().size(), 1u);
    EXPECT_EQ(none.step_triangle_counts()[0], 0u);
}

TEST(SharedLevels, ChangeNoOtherLevelAndAreTheSameAsThoseOfAFreshMesh) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        test::Random random(seed);
        ProgressiveMesh mesh = make_rock(seed), fresh = make_rock(seed);
        mesh.set_triangle_count(600);
        ProgressiveMesh shared = mesh.share();
        EXPECT_EQ(&shared.finest(), &mesh.finest()) << "one mesh";
        EXPECT_EQ(triangles_of(shared), triangles_of(mesh)) << "begins at the same level";
        for (int i = 0; i < 50; ++i) {
            const Triangles before = triangles_of(mesh);
            shared.set_triangle_count(static_cast<std::size_t>(random.below(1300)));
            ASSERT_EQ(triangles_of(mesh), before);
            fresh.set_triangle_count(shared.triangles().size());
            ASSERT_EQ(triangles_of(shared), triangles_of(fresh));
            if (i % 10 == 0) mesh = shared.share();
        }
    }
}

TEST(SharedLevels, ChangeOnThreadsOfTheirOwnAndOutliveTheFirst) {
    std::vector<ProgressiveMesh> shared;
    {
        const ProgressiveMesh mesh = make_rock(2);
        for (int i = 0; i < 3; ++i) shared.push_back(mesh.share());
    }
    std::vector<std::thread> threads;
    for (ProgressiveMesh& each : shared) {
        threads.emplace_back([&each] {
            for (std::size_t count = 1280; count > 100; count -= 40) each.set_triangle_count(count);
            for (std::size_t count = 100; count < 900; count += 30) each.set_triangle_count(count);
        });
    }
    for (std::thread& thread : threads) thread.join();
    ProgressiveMesh fresh = make_rock(2);
    fresh.set_triangle_count(shared[0].triangles().size());
    for (const ProgressiveMesh& each : shared) EXPECT_EQ(triangles_of(each), triangles_of(fresh));
}

}  // namespace shared_levels_test
}  // namespace terrane
