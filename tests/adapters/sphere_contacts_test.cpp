// SPDX-License-Identifier: MIT
#include "engine_grounds.h"
#include "support/random.h"

#include <terrane/adapters/sphere_contacts.h>

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace terrane::adapters {
namespace sphere_contacts_test {

using test::Random;

bool has(std::span<const Contact> contacts, const Contact& wanted) {
    for (const Contact& c : contacts) {
        if ((c.point_world - wanted.point_world).norm() < 1e-6 &&
            (c.normal - wanted.normal).norm() < 1e-6 && std::abs(c.depth - wanted.depth) < 1e-6) {
            return true;
        }
    }
    return false;
}

TEST(SphereContacts, AreThoseOfFindContacts) {
    const auto rough = [](double x, double y) { return 2.0 * test::hills(2.0 * x, 3.0 * y); };
    const Ground grounds[] = {test::hilly_ground(), test::make_test_ground(rough, 1.0, 2)};
    Random random(21);
    int answered = 0, touching = 0;
    for (int i = 0; i < 6000 && !testing::Test::HasFailure(); ++i) {
        const Ground& ground = grounds[i % 2];
        const double radius = random.between(0.05, 1.5), margin = i % 3 == 0 ? 0.02 : 0.0;
        Pose pose;
        pose.translation = {random.between(5.0, 250.0), random.between(5.0, 250.0), 40.0};
        const double lift = compute_lift(Sphere{radius}, pose, ground).lift;
        pose.translation.z() += lift - random.between(-0.02, 0.4 * radius);
        std::array<Contact, 64> fast, slow;
        const auto answer = find_sphere_contacts(ground, pose.translation, radius, margin, fast);
        if (!answer) continue;
        ++answered;
        const ContactAnswer expected = find_contacts(Sphere{radius}, pose, ground, margin, slow);
        touching += answer->count > 0 ? 1 : 0;
        ASSERT_EQ(answer->count > 0, expected.count > 0) << i;
        if (answer->count == 0) continue;
        EXPECT_NEAR(fast[0].depth, slow[0].depth, 1e-9) << i;
        for (std::size_t k = 0; k < answer->count; ++k)
            EXPECT_TRUE(has({slow.data(), expected.count}, fast[k])) << i << " contact " << k;
        for (std::size_t k = 0; k < expected.count; ++k)
            EXPECT_TRUE(has({fast.data(), answer->count}, slow[k])) << i << " expected " << k;
    }
    EXPECT_GT(answered, 5000);
    EXPECT_GT(touching, 3000);
}

TEST(SphereContacts, LeaveToFindContactsWhatTheyCannotAnswer) {
    const Ground ground = test::hilly_ground([](int column, int row) { return column + row != 2; });
    std::array<Contact, 8> contacts;
    const auto answers = [&](const Ground& on, const WorldPos& p, double radius) {
        return find_sphere_contacts(on, p, radius, 0.0, contacts).has_value();
    };
    EXPECT_TRUE(answers(ground, {60, 60, 9}, 0.5));
    EXPECT_FALSE(answers(ground, {60, 60, -9}, 0.5)) << "under the surface";
    EXPECT_FALSE(answers(ground, {180, 180, 9}, 0.5)) << "absent";
    EXPECT_FALSE(answers(ground, {128, 180, 9}, 0.5)) << "partly absent";
    EXPECT_FALSE(answers(ground, {-20, 60, 9}, 0.5)) << "beyond the extent";
    EXPECT_FALSE(answers(ground, {60, 60, 9}, 1e9));
    EXPECT_FALSE(answers(ground, {60, 60, std::numeric_limits<double>::quiet_NaN()}, 0.5));
    EXPECT_FALSE(answers(ground, {60, 60, 9}, std::numeric_limits<double>::quiet_NaN()));
    EXPECT_FALSE(answers(test::slab_ground(), {60, 60, 9}, 0.5)) << "volumes";
}

}  // namespace sphere_contacts_test
}  // namespace terrane::adapters
