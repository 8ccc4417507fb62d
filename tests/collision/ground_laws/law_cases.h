// SPDX-License-Identifier: MIT
#pragma once

#include "collision/ground_laws/brute_force.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/ground.h>

#include <functional>
#include <string>
#include <vector>

namespace terrane::test {

/// Number of cases of a random test: `few`, or `many` times TERRANE_LAWS_SHARE where that is set.
long count_of_cases(long few, long many);

/// A ground and all of its triangles.
struct LawScene {
    std::string name;
    std::function<double(double, double)> height;  ///< of samples, before they become quanta
    int roots = 1;
    Ground ground;
    Soup soup;
};

/// Planes, the contact terrain of the references, spikes and needles of one sample, ridges, walls one cell thick, pits,
/// stairs, noise, cliffs of slope 1e6. Made once.
const std::vector<LawScene>& law_scenes();

/// A shape and its oracle.
struct LawShape {
    std::string name;
    Shape shape;
    OracleShape oracle;
};

/// The shapes that every law is tested with: a new kind of shape is one more entry.
const std::vector<LawShape>& law_shapes();

/// Scene i modulo their number.
const LawScene& scene_of(long i);
const LawScene& scene_named(const std::string& name);
const LawShape& shape_named(const std::string& name);

/// A scene over heights; `roots` squares of 128 cells along a side.
LawScene make_scene(const std::string& name, std::function<double(double, double)> height,
                    const TableGroundSettings& settings);

/// A random pose over a scene, in one case of four aligned with the axes, shifted along z so that the lift is `lift`;
/// for 0, so that it is not less.
Pose random_pose(Random& random, const LawScene& scene, const LawShape& shape, double lift);

/// Everything that identifies a case, for messages: numbers in hexadecimal, so that it can be reproduced.
std::string describe(const LawScene& scene, const LawShape& shape, const Pose& pose);

inline Pose moved(Pose pose, const Eigen::Vector3d& d) {
    pose.translation += d;
    return pose;
}

/// Brute-force lift in long double.
inline double true_lift(const LawScene& scene, const LawShape& shape, const Pose& pose) {
    return static_cast<double>(brute_lift<long double>(scene.soup, shape.oracle, pose));
}

/// Unit of overlaps in laws: half of the smallest extent, or 5 cm where a shape is flat, metres.
inline double law_scale(const LawShape& shape) {
    const double half = smallest_half_extent(shape.shape);
    return half > 0.0 ? half : 0.05;
}

/// Largest depth that laws call shallow: a tenth of the smallest extent, metres.
inline double shallow_depth(const LawShape& shape) { return 0.2 * law_scale(shape); }

}  // namespace terrane::test
