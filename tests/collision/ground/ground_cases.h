// SPDX-License-Identifier: MIT
#pragma once

#include "ground_oracle.h"

#include <span>
#include <vector>

// Poses, motions and grounds of random tests against the ground.
namespace terrane::test {

inline Pose pose_at(double x, double y, double z) {
    Pose pose;
    pose.translation = {x, y, z};
    return pose;
}

inline Pose moved(Pose pose, const Eigen::Vector3d& d) {
    pose.translation += d;
    return pose;
}

inline Pose random_pose(Random& random, const Ground& ground, double low, double high) {
    Pose pose;
    pose.rotation = random.rotation();
    const double x = random.between(10.0, 118.0);
    const double y = random.between(10.0, 118.0);
    pose.translation = {x, y, ground.height(x, y).height + random.between(low, high)};
    return pose;
}

inline Motion straight(const Eigen::Vector3d& from, const Eigen::Vector3d& translation) {
    Motion motion;
    motion.start.translation = from;
    motion.translation = translation;
    return motion;
}

inline Motion random_motion(Random& random, const Ground& ground, double distance, double spin) {
    Motion motion;
    motion.start = random_pose(random, ground, 2.0, 7.0);
    motion.translation = distance * random.direction();
    motion.rotation_vector = spin * random.direction();
    return motion;
}

/// Motion i of many: 5 or 60 m long, with up to four turns.
inline Motion random_motion(Random& random, const Ground& ground, int i) {
    constexpr std::array<double, 4> kSpins{0.0, 0.3, 3.0, 25.0};
    return random_motion(random, ground, i % 3 == 0 ? 5.0 : 60.0,
                         kSpins[static_cast<std::size_t>(i % 4)]);
}

/// The shortest translation that satisfies all contacts, by repeated projection (Dykstra).
inline Eigen::Vector3d resolve(std::span<const Contact> contacts) {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    std::vector<double> corrections(contacts.size(), 0.0);
    for (int round = 0; round < 20000; ++round) {
        double change = 0.0;
        for (std::size_t i = 0; i < contacts.size(); ++i) {
            const double rest = contacts[i].depth - contacts[i].normal.dot(d);
            const double correction = std::max(-corrections[i], rest);
            corrections[i] += correction;
            d += correction * contacts[i].normal;
            change = std::max(change, std::abs(correction));
        }
        if (change < 1e-13) break;
    }
    return d;
}

/// The same rough ground at the origin and 1e7 m east and north of it, whole root squares away.
struct FarGround {
    static constexpr std::int32_t kRoots = 78125;  // of 128 m each
    static constexpr double kShift = 128.0 * kRoots;

    Ground near = make_test_ground(hash_height, 1.0, 1);
    Ground far = make_far();

    /// A pose whose coordinates are exact on both grounds.
    static Pose rounded(Pose pose) {
        for (int k = 0; k < 3; ++k) {
            pose.translation[k] = std::floor(pose.translation[k] * 0x1p20) * 0x1p-20;
        }
        return pose;
    }
    static Pose shifted(const Pose& pose) { return moved(pose, {kShift, kShift, 0.0}); }

private:
    static Ground make_far() {
        TableGroundSettings settings;
        settings.first_root = kRoots;
        return make_test_ground(
            [](double x, double y) { return hash_height(x - kShift, y - kShift); }, settings);
    }
};

}  // namespace terrane::test
