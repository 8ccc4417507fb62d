// SPDX-License-Identifier: MIT
#include "law_cases.h"

#include "references/reference_maps.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace terrane::test {
namespace {

// Pseudorandom height of a lattice point, in [0, 1).
double hash_of(double x, double y) {
    Random random(static_cast<std::uint64_t>(static_cast<std::int64_t>(x) * 0x10001 +
                                             static_cast<std::int64_t>(y)));
    return random.between(0.0, 1.0);
}

bool is_multiple(double p, double of) { return p == of * std::floor(p / of); }

LawScene make_scene(const char* name, std::function<double(double, double)> height,
                    double spacing = 1.0, int roots = 1) {
    TableGroundSettings settings{.spacing = spacing, .roots = roots};
    return test::make_scene(name, std::move(height), settings);
}

LawScene make_contact_terrain() {
    const auto table = std::make_shared<const HeightTable>(make_contact_table(257, 1.0));
    return make_scene(
        "contact terrain",
        [table](double x, double y) {
            const auto index = [](double p) { return static_cast<int>(std::clamp(p, 0.0, 256.0)); };
            return static_cast<double>(table->at(index(x), index(y)));
        },
        1.0, 2);
}

// Hulls that are not centred on their origin. Every point must be a vertex: once sorted, indices equal those of
// features.
LawShape make_hull(const std::string& name, std::vector<Eigen::Vector3d> points) {
    std::sort(points.begin(), points.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    });
    return {name, ConvexHull::create(points).value(), make_hull_oracle(points)};
}

// Points of an ellipsoid, so that no two faces are alike.
LawShape make_irregular_hull() {
    Random random(14);
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 14; ++i) {
        points.push_back(random.direction().cwiseProduct(Eigen::Vector3d(1.1, 0.8, 0.6)) +
                         Eigen::Vector3d(0.2, -0.1, 0.15));
    }
    return make_hull("hull", std::move(points));
}

// All points exactly in one plane.
LawShape make_flat_hull() {
    std::vector<Eigen::Vector3d> points;
    for (const auto& [x, y] :
         {std::pair(1.0, 0.25), std::pair(0.5, 1.0), std::pair(-0.375, 0.875),
          std::pair(-1.0, 0.125), std::pair(-0.625, -0.75), std::pair(0.625, -0.625)}) {
        points.emplace_back(x, y, 0.5 * x - 0.25 * y + 0.125);
    }
    return make_hull("flat hull", std::move(points));
}

// Two overlapping boxes, one of them rotated, and a sphere beside them.
LawShape make_compound() {
    Pose upright, ball;
    upright.rotation << 0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0;
    upright.translation = {0.8, 0.0, 0.6};
    ball.translation = {-0.7, 0.6, 0.3};
    const std::vector<CompoundPart> parts{
        {Box{{1.0, 0.4, 0.25}}, Pose{}}, {Box{{0.3, 0.35, 0.7}}, upright}, {Sphere{0.35}, ball}};
    const Shape shape = Compound::create(parts).value();
    return {"compound", shape, make_oracle(shape)};
}

}  // namespace

long count_of_cases(long few, long many) {
    const double share = number_from("TERRANE_LAWS_SHARE", 0.0);
    return share > 0.0 ? std::max(1L, std::lround(share * static_cast<double>(many))) : few;
}

LawScene make_scene(const std::string& name, std::function<double(double, double)> height,
                    const TableGroundSettings& settings) {
    Ground ground = make_test_ground(height, settings);
    Soup soup(ground);
    return {name, std::move(height), settings.roots, std::move(ground), std::move(soup), 3.0};
}

std::vector<LawShape> make_law_shapes(std::initializer_list<std::pair<const char*, Shape>> named) {
    std::vector<LawShape> made;
    for (const auto& [name, shape] : named) made.push_back({name, shape, make_oracle(shape)});
    return made;
}

const LawScene& scene_of(long i) {
    return law_scenes()[static_cast<std::size_t>(i) % law_scenes().size()];
}

const LawScene& scene_named(const std::string& name) {
    return *std::find_if(law_scenes().begin(), law_scenes().end(),
                         [&](const LawScene& scene) { return scene.name == name; });
}

const LawShape& shape_named(const std::string& name) {
    return *std::find_if(law_shapes().begin(), law_shapes().end(),
                         [&](const LawShape& shape) { return shape.name == name; });
}

const std::vector<LawScene>& law_scenes() {
    static const std::vector<LawScene> scenes = [] {
        std::vector<LawScene> made;
        made.push_back(make_scene("level plane", [](double, double) { return 1.5; }));
        made.push_back(
            make_scene("sloped plane", [](double x, double y) { return 0.25 * x - 0.5 * y; }));
        made.push_back(make_contact_terrain());
        made.push_back(make_scene("spikes", [](double x, double y) {
            return is_multiple(x, 5.0) && is_multiple(y, 5.0) ? 3.0 : 0.0;
        }));
        made.push_back(make_scene("ridges", [](double x, double) {
            return std::abs(x - 4.0 * std::floor(x / 4.0) - 2.0);
        }));
        made.push_back(
            make_scene("walls", [](double x, double) { return is_multiple(x, 8.0) ? 5.0 : 0.0; }));
        made.push_back(make_scene("pits", [](double x, double y) {
            return is_multiple(x, 6.0) && is_multiple(y, 6.0) ? -4.0 : 0.0;
        }));
        made.push_back(
            make_scene("stairs", [](double x, double) { return 0.5 * std::floor(x / 4.0); }));
        made.push_back(make_scene("rough", [](double x, double y) { return hash_of(x, y); }));
        made.push_back(make_scene(
            "needles",
            [](double x, double y) { return hash_of(8.0 * x, 8.0 * y) < 0.01 ? 4.0 : 0.0; },
            0.125));
        made.push_back(make_scene(
            "cliffs",
            [](double x, double) { return is_multiple(std::floor(x), 2.0) ? 125e3 : 0.0; }, 0.125));
        return made;
    }();
    return scenes;
}

const std::vector<LawShape>& law_shapes() {
    static const std::vector<LawShape> shapes = [] {
        std::vector<LawShape> made = make_law_shapes({
            {"sphere", Sphere{0.5}},
            {"capsule", Capsule{0.4, 0.8}},
            {"box", Box{{1.0, 1.5, 0.5}}},
            {"rod", Box{{0.05, 0.07, 1.5}}},
        });
        made.push_back(make_irregular_hull());
        made.push_back(make_flat_hull());
        made.push_back(make_compound());
        return made;
    }();
    return shapes;
}

Pose random_pose(Random& random, const LawScene& scene, const LawShape& shape, double lift) {
    const WorldRect& extent = scene.ground.extent();
    const double width = extent.east - extent.west, depth = extent.north - extent.south;
    const double border = scene.border;
    Pose pose{.rotation = random.rotation()};
    if (random.below(4) == 0) {
        pose.rotation.setZero();
        const int first = random.below(3), turn = 1 + random.below(2);
        for (int k = 0; k < 3; ++k) pose.rotation((first + turn * k) % 3, k) = 1.0;
        if (pose.rotation.determinant() < 0.0) pose.rotation.col(0) = -pose.rotation.col(0);
    }
    double first_lift = 0.0;
    do {
        pose.translation.x() = extent.west + random.between(border, width - border);
        pose.translation.y() = extent.south + random.between(border, depth - border);
        pose.translation.z() = scene.soup.height(pose.translation.x(), pose.translation.y());
        first_lift = brute_lift<double>(scene.soup, shape.oracle, pose);
    } while (!std::isfinite(first_lift));  // no part of the shape is over the ground
    pose.translation.z() += first_lift - lift;
    // Repeated in long double to remove the rounding error; few triangles matter by now.
    pose.translation.z() += static_cast<double>(brute_lift<long double>(
                                scene.soup, shape.oracle, pose, Vec<long double>::Zero(),
                                static_cast<long double>(lift) - 1e-3L)) -
                            lift;
    while (lift == 0.0 && true_lift(scene, shape, pose) < 0.0) {
        pose.translation.z() =
            std::nextafter(pose.translation.z(), -std::numeric_limits<double>::infinity());
    }
    return pose;
}

std::string describe(const LawScene& scene, const LawShape& shape, const Pose& pose) {
    std::string text = scene.name + ", " + shape.name + " at";
    char number[32];
    for (int i = 0; i < 3; ++i) {
        std::snprintf(number, sizeof number, " %a", pose.translation[i]);
        text += number;
    }
    text += ", rotation by rows";
    for (int i = 0; i < 9; ++i) {
        std::snprintf(number, sizeof number, " %a", pose.rotation(i / 3, i % 3));
        text += number;
    }
    return text;
}

}  // namespace terrane::test
