// MuJoCo bodies fall onto Terrane ground: see docs/adapters.md. Prints how many of them end below the ground.
#include "motion_trace.h"

#include <terrane/adapters/mujoco_window.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <mujoco/mujoco.h>

#include <cstdio>
#include <fstream>
#include <span>
#include <string>

int main(int argc, char** argv) {
    using namespace terrane;
    MotionTrace trace(argc, argv);
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    RequiredRegion start = terrain.require({-60, -60, 60, 60}, 0.0);
    const Ground first = terrain.load({}, {}, 0.0).ground;
    const WorldPos origin(0.0, 0.0, first.height(0.0, 0.0).height);

    // The model: the hfield on a mocap body, 128 x 128 cells, and balls above the ground.
    const adapters::MujocoHfieldXml field =
        adapters::hfield_xml("ground", 128, first.spacing(), 200.0, 5.0);
    std::string xml = "<mujoco><asset>" + field.asset + "</asset><worldbody>" + field.body;
    for (int i = 0; i < 8; ++i) {
        const double x = 3.0 * i - 10.0;
        const double z = first.height(x, 2.0).height - origin.z() + 2.0;
        xml += "<body pos=\"" + std::to_string(x) + " 2 " + std::to_string(z) +
               "\"><freejoint/><geom type=\"sphere\" size=\"0.4\"/></body>";
    }
    xml += "</worldbody></mujoco>";
    const char* const path = "terrane_mujoco_ground.xml";
    std::ofstream(path) << xml;
    char error[500] = "";
    mjModel* const model = mj_loadXML(path, nullptr, error, sizeof error);
    std::remove(path);
    if (model == nullptr) {
        std::printf("MuJoCo refused the model: %s\n", error);
        return 1;
    }
    mjData* const data = mj_makeData(model);
    mj_forward(model, data);
    using Window = adapters::MujocoWindow<mjModel, mjData>;
    Window window =
        Window::create(*model, mj_name2id(model, mjOBJ_GEOM, "ground"), {.origin_world = origin})
            .value();
    start.release();

    int held = 0, uploads = 0;
    for (int step = 0; step < 2000; ++step) {
        // 1. What the bodies need. 2. The newest ground, and the window around the bodies. 3. The step.
        const std::span<const BodyNeed> needs = window.needs(*model, *data);
        const Ground& now = terrain.update({}, needs, data->time).ground;
        const adapters::MujocoWindowUpdate update = window.update(*model, *data, now);
        if (update.has_changed) ++uploads;  // mjr_uploadHField(model, context, window.hfield_id())
        if (update.status != adapters::MujocoWindowStatus::ok || update.unsupported_boxes > 0) {
            ++held;  // the simulation waits for its ground
            continue;
        }
        mj_step(model, data);
        for (const std::size_t i : {0u, 3u, 6u}) {
            const WorldPos& p = needs[i].centre_world;
            trace.add("ball " + std::to_string(i), data->time, p, now.height(p.x(), p.y()).height);
        }
    }

    int below = 0;
    const Ground& last = terrain.frame().ground;
    const std::span<const BodyNeed> balls = window.needs(*model, *data);
    for (const BodyNeed& ball : balls) {
        const WorldPos& p = ball.centre_world;
        if (p.z() < last.height(p.x(), p.y()).height) ++below;
    }
    std::printf(
        "%zu balls after %.2f s; the window was written %d times; %d steps waited, %d balls below "
        "the ground\n",
        balls.size(), data->time, uploads, held, below);
    mj_deleteData(data);
    mj_deleteModel(model);
    return below == 0 && held == 0 ? 0 : 1;
}
