// SPDX-License-Identifier: MIT
#include "flight/cameras.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace terrane::tools {
namespace drop_camera_test {

const std::shared_ptr<const HeightSource> kHills = FractalHeights::create({.seed = 9}).value();

BodyState body_at(double x, double y) {
    BodyState state;
    state.pose.translation = {x, y, kHills->height(x, y) + 1.0};
    return state;
}

View make_picture() {
    View view;
    view.width_px = 160;
    view.height_px = 90;
    view.vertical_fov = 1.0;
    return view;
}

TEST(DropCamera, LooksAtTheMiddleFromAboveTheGroundAndFollows) {
    std::vector<BodyState> bodies{body_at(100.0, 100.0), body_at(160.0, 100.0),
                                  body_at(130.0, 150.0)};
    DropCamera camera(kHills, bodies);
    for (int frame = 0; frame < 600; ++frame) {
        for (BodyState& body : bodies) {
            const WorldPos& p = body.pose.translation;
            body = body_at(p.x() + 0.5, p.y() - 0.2);
        }
        camera.follow(bodies, 1.0 / 30.0);
        const View view = camera.view(make_picture());
        ASSERT_TRUE(check(view)) << frame;
        ASSERT_GT(view.eye_world.z(), kHills->height(view.eye_world.x(), view.eye_world.y()));
        EXPECT_LT(camera.velocity().norm(), 60.0) << frame;
        WorldPos middle = WorldPos::Zero();
        for (const BodyState& body : bodies) middle += body.pose.translation / 3.0;
        const Eigen::Vector3d to = (middle - view.eye_world).normalized();
        EXPECT_GT(to.dot(view.forward), 0.9) << frame;
    }
}

TEST(DropCamera, SeesOneBodyFromAFewMetres) {
    const std::vector<BodyState> bodies{body_at(40.0, -70.0)};
    const DropCamera camera(kHills, bodies);
    const double distance =
        (camera.view(make_picture()).eye_world - bodies[0].pose.translation).norm();
    EXPECT_GT(distance, 2.0);
    EXPECT_LT(distance, 20.0);
}

// Bodies outside the extent are not followed, unless all are.
TEST(DropCamera, StaysWithThoseThatAreOnTheTerrain) {
    std::vector<BodyState> bodies{body_at(0.0, 0.0), body_at(10.0, 0.0)};
    DropCamera camera(kHills, bodies);
    const WorldPos before = camera.view(make_picture()).eye_world;
    bodies[1].condition = BodyCondition::left_world;
    bodies[1].pose.translation = {1e6, 0.0, -1e6};
    camera.follow(bodies, 1.0 / 30.0);
    EXPECT_LT((camera.view(make_picture()).eye_world - before).norm(), 5.0);
    bodies[0] = bodies[1];
    camera.follow(bodies, 1.0 / 30.0);
    EXPECT_TRUE(check(camera.view(make_picture())));
}

}  // namespace drop_camera_test
}  // namespace terrane::tools
