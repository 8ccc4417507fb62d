// SPDX-License-Identifier: MIT
#include "scene/scene_bodies.h"
#include "scene/scene_objects.h"
#include "scene/terrain_options.h"

#include <gtest/gtest.h>

#include <string>
#include <variant>

namespace terrane::tools {
namespace scene_test {

std::string message_of(const std::string& rest) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":1,)" + rest + "}", "s/one.json");
    return scene ? "" : scene.error().message;
}

/// The message for one body.
std::string of_body(const std::string& rest) {
    return message_of(R"("bodies":[{"shape":{"sphere":{"radius":1}},"position":[0,0,0]},{)" + rest +
                      "}]");
}

TEST(SceneBodies, HaveEveryShapeAndType) {
    const CommandResult<TerrainOptions> scene = parse_scene(R"({"seed":1,"bodies":[
        {"shape":{"sphere":{"radius":0.5}},"position":[1,2,3],"velocity":[4,5,6],"spin":[7,8,9],"mass":20,
         "friction":0.3,"restitution":0.9},
        {"shape":{"capsule":{"radius":0.4,"half_height":1}},"position":[0,0,5],"type":"kinematic","velocity":[0,1,0]},
        {"shape":{"box":{"half_extents":[1,2,3]}},"position":[0,0,0],"rotation":[0,1,0,0],"type":"static"},
        {"shape":{"hull":{"points":[[0,0,0],[1,0,0],[0,1,0],[0,0,1]]}},"position":[0,0,9],"type":"dynamic"},
        {"shape":{"compound":[{"shape":{"sphere":{"radius":1}}},
                              {"shape":{"box":{"half_extents":[1,1,1]}},"position":[2,0,0]}]},"position":[0,9,9]}]})",
                                                            "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    const std::vector<PlacedBody>& bodies = scene->bodies;
    ASSERT_EQ(bodies.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(bodies[i].settings.shape.index(), i);
    const PlacedBody& ball = bodies[0];
    EXPECT_EQ(ball.settings.type, BodyType::dynamic_body);
    EXPECT_EQ(ball.settings.mass, 20.0);
    EXPECT_EQ(ball.settings.friction, 0.3);
    EXPECT_EQ(ball.settings.restitution, 0.9);
    EXPECT_EQ(ball.state.pose.translation, WorldPos(1.0, 2.0, 3.0));
    EXPECT_EQ(ball.state.velocity, Eigen::Vector3d(4.0, 5.0, 6.0));
    EXPECT_EQ(ball.state.angular_velocity, Eigen::Vector3d(7.0, 8.0, 9.0));
    EXPECT_EQ(bodies[1].settings.type, BodyType::kinematic_body);
    EXPECT_EQ(bodies[2].settings.type, BodyType::static_body);
    EXPECT_EQ(bodies[2].state.pose.rotation(1, 1), -1.0);
    EXPECT_EQ(bodies[3].settings.mass, BodySettings{}.mass);
    EXPECT_EQ(bodies[3].settings.friction, BodySettings{}.friction);
    EXPECT_EQ(std::get<Compound>(bodies[4].settings.shape).parts().size(), 2u);
}

TEST(SceneBodies, AreRefusedByThePathOfTheKeyAndTheValue) {
    const std::string ball = R"("shape":{"sphere":{"radius":1}},"position":[0,0,0])";
    EXPECT_EQ(of_body(ball + R"(,"mass":-1)"),
              "scene 's/one.json': bodies[1].mass must be 1e-09 to 1e+12, got -1");
    EXPECT_EQ(of_body(ball + R"(,"mass":"heavy")"),
              R"(scene 's/one.json': bodies[1].mass must be a number, got "heavy")");
    EXPECT_EQ(of_body(ball + R"(,"friction":-0.5)"),
              "scene 's/one.json': bodies[1].friction must be 0 to 1e+06, got -0.5");
    EXPECT_EQ(of_body(ball + R"(,"restitution":2)"),
              "scene 's/one.json': bodies[1].restitution must be 0 to 1, got 2");
    EXPECT_EQ(of_body(ball + R"(,"colour":"red")"),
              "scene 's/one.json': unknown key 'bodies[1].colour'");
    EXPECT_EQ(of_body(ball + R"(,"positoin":1)"),
              "scene 's/one.json': unknown key 'bodies[1].positoin'; did you mean position?");
    EXPECT_EQ(
        of_body(ball + R"(,"type":"fixed")"),
        "scene 's/one.json': bodies[1].type must be dynamic, static or kinematic, got \"fixed\"");
    EXPECT_EQ(
        of_body(ball + R"(,"type":"static","mass":5)"),
        "scene 's/one.json': bodies[1].mass is of dynamic bodies only, got 5 and type \"static\"");
    EXPECT_EQ(of_body(ball + R"(,"type":"static","velocity":[0,0,1])"),
              "scene 's/one.json': bodies[1].velocity must be 0 of a static body, got [0,0,1]");
    EXPECT_EQ(of_body(ball + R"(,"spin":[1e9,0,0])"),
              "scene 's/one.json': bodies[1].spin must be -1e6 to 1e6 along each axis, got "
              "[1000000000.0,0,0]");
    EXPECT_EQ(of_body(ball + R"(,"rotation":[2,0,0,0])"),
              "scene 's/one.json': bodies[1].rotation must be [w, x, y, z] of length 1 to 1e-6, "
              "got length 2");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":1}})"),
              "scene 's/one.json': bodies[1].position is missing");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":1}},"position":[0,0])"),
              "scene 's/one.json': bodies[1].position must be 3 numbers, got [0,0]");
    EXPECT_EQ(of_body(R"("position":[0,0,0])"), "scene 's/one.json': bodies[1].shape is missing");
    EXPECT_EQ(of_body(R"("shape":{"cube":{}},"position":[0,0,0])"),
              "scene 's/one.json': bodies[1].shape must be sphere, capsule, box, hull or compound, "
              "got \"cube\"");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{}},"position":[0,0,0])"),
              "scene 's/one.json': bodies[1].shape: radius is missing");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":0}},"position":[0,0,0])"),
              "scene 's/one.json': bodies[1].shape must have a thickness, got "
              "{\"sphere\":{\"radius\":0}}");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":1,"r":2}},"position":[0,0,0])"),
              "scene 's/one.json': unknown key 'bodies[1].shape.sphere.r'");
    EXPECT_EQ(
        of_body(
            R"("shape":{"compound":[{"shape":{"box":{"half_extents":[1,1,1],"x":2}}}]},"position":[0,0,0])"),
        "scene 's/one.json': unknown key 'bodies[1].shape.compound[0].shape.box.x'");
    EXPECT_EQ(message_of(R"("bodies":[7])"),
              "scene 's/one.json': bodies[0] must be an object, got 7");
    EXPECT_EQ(message_of(R"("bodies":{})"), "scene 's/one.json': bodies must be a list, got {}");
}

TEST(SceneSurface, OfRectanglesGivesFrictionByPlace) {
    const CommandResult<TerrainOptions> scene = parse_scene(R"({"seed":1,"surface":[
        {"rect":[-10,-20,30,40],"friction":0.1},{"rect":[0,0,5,5],"friction":0.9,"restitution":0.5}]})",
                                                            "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    const auto map = open_surface(*scene->surface, nullptr);
    ASSERT_TRUE(map);
    EXPECT_EQ((*map)->at(-5.0, 39.0).friction, 0.1);
    EXPECT_EQ((*map)->at(2.0, 2.0).friction, 0.9);
    EXPECT_EQ((*map)->at(2.0, 2.0).restitution, 0.5);
    EXPECT_EQ((*map)->at(99.0, 0.0).friction, SurfaceProperties{}.friction);
}

TEST(SceneSurface, OfARasterIsFoundFromTheScenesFolder) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":1,"surface":"a/ice.tif"})", "scenes/one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->surface->raster, "scenes/a/ice.tif");
    const auto map = open_surface(*scene->surface, nullptr);
    ASSERT_FALSE(map);
    EXPECT_NE(map.error().message.find("scenes/a/ice.tif"), std::string::npos);
}

TEST(SceneSurface, IsRefusedByThePathOfTheKeyAndTheValue) {
    const auto of = [](const std::string& surface) {
        return message_of(R"("surface":)" + surface);
    };
    EXPECT_EQ(of("5"), "scene 's/one.json': surface must be a path or a list of rectangles, got 5");
    EXPECT_EQ(of(R"([{"rect":[0,0,1,1],"friction":-1}])"),
              "scene 's/one.json': surface[0].friction must be 0 to 1e+06, got -1");
    EXPECT_EQ(of(R"([{"rect":[0,0,1,1]}])"), "scene 's/one.json': surface[0].friction is missing");
    EXPECT_EQ(of(R"([{"rect":[0,0,1],"friction":1}])"),
              "scene 's/one.json': surface[0].rect must be 4 numbers, got [0,0,1]");
    EXPECT_EQ(of(R"([{"rect":[2,0,1,1],"friction":1}])"),
              "scene 's/one.json': surface[0].rect must be [west, south, east, north] with west <= "
              "east and "
              "south <= north, got [2,0,1,1]");
    EXPECT_EQ(of(R"([{"rect":[0,0,1,1],"friction":1,"ice":1}])"),
              "scene 's/one.json': unknown key 'surface[0].ice'");
}

TEST(ParseScene, RefusesDeepBrackets) {
    const std::string deep(100'000, '[');
    EXPECT_NE(message_of("\"seed\":" + deep).find("deeper than 64"), std::string::npos);
    EXPECT_NE(message_of("\"bodeis\":[]").find("did you mean bodies?"), std::string::npos);
}

}  // namespace scene_test
}  // namespace terrane::tools
