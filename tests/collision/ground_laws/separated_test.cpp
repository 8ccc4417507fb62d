// SPDX-License-Identifier: MIT
// Shapes below the ground are separated by repeatedly finding contacts and resolving them all.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cstdio>
#include <span>
#include <vector>

namespace terrane {
namespace freed_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260305;
constexpr int kRounds = 8;

using V = Vec<long double>;

// The shortest d with n.d >= depth for some contacts, by trying all sets of up to three of them.
V shortest_for(const std::vector<const Contact*>& some) {
    V best = V::Constant(1e30L);
    const auto consider = [&](const V& d) {
        if (!(d.squaredNorm() < best.squaredNorm())) return;
        for (const Contact* contact : some) {
            const long double over = contact->normal.cast<long double>().dot(d) - contact->depth;
            if (over < -1e-13L * (1 + d.norm())) return;
        }
        best = d;
    };
    const auto n = [&](std::size_t i) { return V(some[i]->normal.cast<long double>()); };
    const auto b = [&](std::size_t i) { return static_cast<long double>(some[i]->depth); };
    consider(V::Zero());
    for (std::size_t i = 0; i < some.size(); ++i) {
        consider(b(i) * n(i) / n(i).squaredNorm());
        for (std::size_t j = i + 1; j < some.size(); ++j) {
            const V c = n(i).cross(n(j));
            const long double square = c.squaredNorm();
            if (square < 1e-24L) continue;
            consider((b(i) * n(j).cross(c) + b(j) * c.cross(n(i))) / square);
            for (std::size_t k = j + 1; k < some.size(); ++k) {
                const long double volume = c.dot(n(k));
                if (std::abs(volume) < 1e-12L) continue;
                consider((b(i) * n(j).cross(n(k)) + b(j) * n(k).cross(n(i)) + b(k) * c) / volume);
            }
        }
    }
    return best;
}

// The shortest translation that resolves all contacts, by an active set: the contact that is violated most is added.
Eigen::Vector3d resolve(std::span<const Contact> contacts) {
    std::vector<const Contact*> some;
    V d = V::Zero();
    for (std::size_t round = 0; round < contacts.size(); ++round) {
        const Contact* worst = nullptr;
        long double least = -1e-12L * (1 + d.norm());
        for (const Contact& contact : contacts) {
            const long double over = contact.normal.cast<long double>().dot(d) - contact.depth;
            if (over < least) {
                least = over;
                worst = &contact;
            }
        }
        if (worst == nullptr) break;
        some.push_back(worst);
        d = shortest_for(some);
    }
    return d.cast<double>();
}

TEST(SeparatedFromBelow, WithinEightRoundsFromAnyDepth) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const long count = count_of_cases(66, 20'000);
    std::array<Contact, 256> contacts;
    std::printf("rounds:%28s", "");
    for (int round = 0; round <= kRounds; ++round) std::printf("%7d", round);
    std::printf("   not separated\n");
    for (const LawShape& shape : law_shapes()) {
        for (const double below : {0.1, 0.3, 1.0, 3.0, 100.0}) {
            std::array<long, kRounds + 2> rounds{};
            for (long i = 0; i < count; ++i) {
                const LawScene& scene = scene_of(i);
                const Pose start = random_pose(random, scene, shape, 0.0);
                Pose pose = start;
                pose.translation.z() =
                    scene.soup.height(pose.translation.x(), pose.translation.y()) - below;
                const Pose below_ground = pose;
                int round = 0;
                for (; round <= kRounds; ++round) {
                    const ContactAnswer answer =
                        find_contacts(shape.shape, pose, scene.ground, 0.0, contacts);
                    if (!is_deeper<long double>(scene.soup, shape.oracle, pose,
                                                Vec<long double>::Zero(), 1e-8L)) {
                        break;
                    }
                    const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
                    pose = moved(pose, d);
                }
                ++rounds[static_cast<std::size_t>(round)];
                EXPECT_LE(round, kRounds) << describe(scene, shape, below_ground);
            }
            std::printf("%-8s %5.1f m below, %6ld:  ", shape.name.c_str(), below, count);
            for (const long many : rounds) std::printf("%7ld", many);
            std::printf("\n");
        }
    }
}

}  // namespace freed_test
}  // namespace terrane
