// SPDX-License-Identifier: MIT
#pragma once

#include "collision/ground/ground_cases.h"
#include "collision/ground_laws/brute_force.h"

#include <functional>
#include <string>
#include <vector>

namespace terrane::test {

/// Cases of a random test: `few`, or TERRANE_LAWS_SHARE times `many` if that is set.
long count_of_cases(long few, long many);

/// A ground and all its triangles.
struct LawScene {
    std::string name;
    std::function<double(double, double)> height;  ///< of samples, before rounding to quanta
    int roots = 1;
    Ground ground;
    Soup soup;
    double border = 3.0;  ///< distance of random poses from the edges of the extent, metres
};

/// Planes, the contact map of tests/references, spikes and needles of one sample, ridges, walls one cell thick, pits,
/// stairs, noise, cliffs of slope 1e6. Made once.
const std::vector<LawScene>& law_scenes();

/// A shape with its oracle.
struct LawShape {
    std::string name;
    Shape shape;
    OracleShape oracle;
};

/// Each shape with make_oracle().
std::vector<LawShape> make_law_shapes(std::initializer_list<std::pair<const char*, Shape>> named);

/// The shapes that every law is tested with. A new kind of shape is added here.
const std::vector<LawShape>& law_shapes();

/// Scene i modulo the number of scenes.
const LawScene& scene_of(long i);
const LawScene& scene_named(const std::string& name);
const LawShape& shape_named(const std::string& name);

/// A scene over a height function, with `roots` squares of 128 cells along a side.
LawScene make_scene(const std::string& name, std::function<double(double, double)> height,
                    const TableGroundSettings& settings);

/// A random pose over a scene, axis-aligned in one of four cases, shifted along z to the given lift; for a lift of 0
/// rounded so that it is not negative.
Pose random_pose(Random& random, const LawScene& scene, const LawShape& shape, double lift);

/// Identifies a case in messages, with hexadecimal numbers that reproduce it exactly.
std::string describe(const LawScene& scene, const LawShape& shape, const Pose& pose);

/// Brute-force lift in long double.
inline double true_lift(const LawScene& scene, const LawShape& shape, const Pose& pose) {
    return static_cast<double>(brute_lift<long double>(scene.soup, shape.oracle, pose));
}

/// Unit of overlaps: half the smallest extent, or 5 cm for flat shapes, metres.
inline double law_scale(const LawShape& shape) {
    const double half = smallest_half_extent(shape.shape);
    return half > 0.0 ? half : 0.05;
}

/// Largest depth that counts as shallow: a tenth of the smallest extent, metres.
inline double shallow_depth(const LawShape& shape) { return 0.2 * law_scale(shape); }

}  // namespace terrane::test
