// ODE bodies fall onto Terrane ground: see docs/adapters.md. Prints how many of them end below the ground.
#include "motion_trace.h"

#include <terrane/adapters/ode_ground.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <ode/ode.h>

#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

namespace {

struct Simulation {
    dWorldID world = nullptr;
    dJointGroupID joints = nullptr;
};

void near_callback(void* data, dGeomID a, dGeomID b) {
    const auto& simulation = *static_cast<Simulation*>(data);
    std::array<dContact, 8> contacts{};
    const int count = dCollide(a, b, 8, &contacts[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
        dContact& contact = contacts[static_cast<std::size_t>(i)];
        contact.surface.mode = dContactApprox1;
        contact.surface.mu = 1;
        dJointAttach(dJointCreateContact(simulation.world, simulation.joints, &contact),
                     dGeomGetBody(contact.geom.g1), dGeomGetBody(contact.geom.g2));
    }
}

}  // namespace

int main(int argc, char** argv) {
    using namespace terrane;
    MotionTrace trace(argc, argv);
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    RequiredRegion start = terrain.require({-60, -60, 60, 60}, 0.0);
    const Ground first = terrain.load({}, {}, 0.0).ground;

    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateFlagCollisionData);
    Simulation simulation{dWorldCreate(), dJointGroupCreate(0)};
    dWorldSetGravity(simulation.world, 0, 0, dReal(-9.81));
    const dSpaceID space = dHashSpaceCreate(nullptr);
    const WorldPos origin(0.0, 0.0, first.height(0.0, 0.0).height);
    std::optional<adapters::OdeGround> ground;
    ground.emplace(adapters::OdeGround::make_class(),
                   adapters::OdeGroundSettings{.origin_world = origin});

    std::vector<dBodyID> bodies;
    for (int i = 0; i < 20; ++i) {
        const double x = 3.0 * i - 30.0, y = 5.0;
        const dBodyID body = dBodyCreate(simulation.world);
        dMass mass;
        dMassSetSphereTotal(&mass, 30, dReal(0.4));
        dBodySetMass(body, &mass);
        dGeomSetBody(i % 2 == 0 ? dCreateSphere(space, dReal(0.4)) : dCreateBox(space, 1, 1, 1),
                     body);
        dBodySetPosition(body, dReal(x), dReal(y),
                         dReal(first.height(x, y).height + 4.0 - origin.z()));
        bodies.push_back(body);
    }
    start.release();

    const double dt = 1.0 / 60.0;
    for (int frame = 0; frame < 300; ++frame) {
        // 1. What the bodies need. 2. The newest ground, which releases held bodies. 3. Contacts. 4. The step.
        ground->update(terrain.update({}, ground->needs(), frame * dt).ground, dt);
        dSpaceCollide2(ground->geom(), reinterpret_cast<dGeomID>(space), &simulation,
                       &near_callback);
        dSpaceCollide(space, &simulation, &near_callback);
        dWorldQuickStep(simulation.world, dReal(dt));
        dJointGroupEmpty(simulation.joints);
        for (const std::size_t i : {4u, 9u, 14u}) {
            const WorldPos p = ground->to_world(dBodyGetPosition(bodies[i]));
            trace.add((i % 2 == 0 ? "ball " : "box ") + std::to_string(i), frame * dt, p,
                      ground->ground()->height(p.x(), p.y()).height);
        }
    }

    int below = 0;
    for (const dBodyID body : bodies) {
        const WorldPos p = ground->to_world(dBodyGetPosition(body));
        if (p.z() < ground->ground()->height(p.x(), p.y()).height) ++below;
    }
    std::printf("%zu bodies, %zu held, %d below the ground\n", bodies.size(), ground->held_count(),
                below);
    ground.reset();
    dJointGroupDestroy(simulation.joints);
    dSpaceDestroy(space);
    dWorldDestroy(simulation.world);
    dCloseODE();
    return below == 0 ? 0 : 1;
}
