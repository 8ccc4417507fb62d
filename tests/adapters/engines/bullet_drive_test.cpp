// SPDX-License-Identifier: MIT
//
// Bullet's own vehicle drives for ten minutes over a surveyed raster with fractal detail, in a frame that follows it,
// while chunks come and go. Where it lies on its side or stands still for 5 s it is set on its wheels again.
#include "adapters/engines/bullet_scene.h"

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

namespace terrane {
namespace bullet_drive_test {

using adapters::BulletGround;

constexpr double kDt = 1.0 / 60.0;

std::string raster_file() {
    const char* const folder = std::getenv("TERRANE_DATA");
    return (folder != nullptr ? folder : TERRANE_SOURCE_DIR "/../shared/data") +
           std::string("/dem/srtm3_sierra_nevada_3601x2401.tif");
}

class Drive {
public:
    explicit Drive(const std::shared_ptr<const HeightSource>& source)
        // so little that chunks are evicted
        : pager_(Pager::create(source, {.memory_bytes = std::size_t{12} << 20},
                               VirtualLoader::create({.latency = 0.05, .latency_spread = 1.0},
                                                     [source](const ChunkKey& key) {
                                                         return make_chunk(*source, key);
                                                     })
                                   .value())
                     .value()),
          chassis_(scene_.add(std::make_unique<btBoxShape>(btVector3(2, 1, btScalar(0.4))),
                              btVector3(0, 0, 0), 1500.0)),
          vehicle_(tuning_, &chassis_, &raycaster_) {
        vehicle_.setCoordinateSystem(1, 2, 0);
        for (const double x : {1.4, -1.4}) {
            for (const double y : {0.9, -0.9}) {
                btWheelInfo& wheel = vehicle_.addWheel(
                    btVector3(btScalar(x), btScalar(y), btScalar(-0.1)), btVector3(0, 0, -1),
                    btVector3(0, -1, 0), btScalar(0.5), btScalar(0.45), tuning_, x > 0);
                wheel.m_suspensionStiffness = 40;
                wheel.m_wheelsDampingRelaxation = 4;
                wheel.m_wheelsDampingCompression = 4;
                wheel.m_rollInfluence = btScalar(0.02);
                wheel.m_maxSuspensionForce = 40000;
            }
        }
        scene_.world.addVehicle(&vehicle_);
        RequiredRegion start = pager_.require({-200, -200, 200, 200}, 0.0);
        pager_.update({}, {}, 0.0);
        pager_.finish();
        take_ground();
        put({0.0, 0.0, 0.0}, 0.0);
        start.release();
    }
    ~Drive() { scene_.world.removeVehicle(&vehicle_); }
    Drive(const Drive&) = delete;
    Drive& operator=(const Drive&) = delete;

    void step(int index) {
        const double time = kDt * (index + 1);
        pager_.update({}, scene_.keeper.needs(scene_.world, scene_.shape), time);
        take_ground();
        const double turn = 0.25 * std::sin(0.13 * time);
        for (int wheel = 0; wheel < 4; ++wheel) {
            vehicle_.applyEngineForce(btScalar(vehicle_.getCurrentSpeedKmHour() < 50 ? 2500 : 0),
                                      wheel);
        }
        vehicle_.setSteeringValue(btScalar(turn), 0);
        vehicle_.setSteeringValue(btScalar(turn), 1);
        scene_.step(kDt);
        held_steps += scene_.keeper.held_count() > 0 ? 1 : 0;
        const WorldPos place = world_place();
        const double moved = (place - last_).norm();
        distance += moved;
        last_ = place;
        slow_steps_ = moved < 0.5 * kDt ? slow_steps_ + 1 : 0;
        const bool is_tipped = chassis_.getWorldTransform().getBasis().getColumn(2).z() < 0.3;
        tipped_steps_ = is_tipped ? tipped_steps_ + 1 : 0;
        if (slow_steps_ > 300 || tipped_steps_ > 300) {
            ++resets;
            heading_ += 1.9;
            put(place, heading_);
        }
        if (frame_distance() > 1500.0) move_frame();
    }

    WorldPos world_place() const {
        return scene_.shape.to_world(chassis_.getWorldTransform().getOrigin());
    }
    HeightAnswer height() const {
        const WorldPos p = world_place();
        return scene_.shape.ground()->height(p.x(), p.y());
    }
    const Pager& pager() const { return pager_; }

    double distance = 0.0;
    int held_steps = 0, resets = 0, frames = 0;

private:
    void take_ground() { scene_.set_ground(pager_.ground()); }
    double frame_distance() const {
        return double(chassis_.getWorldTransform().getOrigin().length());
    }
    // Upright, above the ground at a place.
    void put(const WorldPos& place, double heading) {
        const HeightAnswer at = scene_.shape.ground()->height(place.x(), place.y());
        const btVector3 p = scene_.shape.to_shape({place.x(), place.y(), at.height + 1.5});
        const btQuaternion turn(btVector3(0, 0, 1), btScalar(heading));
        chassis_.setCenterOfMassTransform(btTransform(turn, p));
        chassis_.setInterpolationWorldTransform(chassis_.getWorldTransform());
        chassis_.setLinearVelocity(btVector3(0, 0, 0));
        chassis_.setAngularVelocity(btVector3(0, 0, 0));
        vehicle_.resetSuspension();
        last_ = world_place();
        slow_steps_ = tipped_steps_ = 0;
    }
    // Makes the vehicle's place the origin of Bullet's frame.
    void move_frame() {
        const WorldPos place = world_place();
        scene_.shape.set_origin(place);
        btTransform at = chassis_.getWorldTransform();
        at.setOrigin(btVector3(0, 0, 0));
        chassis_.setCenterOfMassTransform(at);
        chassis_.setInterpolationWorldTransform(at);
        scene_.world.updateSingleAabb(&scene_.ground_body);
        scene_.world.updateSingleAabb(&chassis_);
        ++frames;
    }

    test::BulletScene scene_;
    Pager pager_;
    btRaycastVehicle::btVehicleTuning tuning_;
    btRigidBody& chassis_;
    btDefaultVehicleRaycaster raycaster_{&scene_.world};
    btRaycastVehicle vehicle_;
    WorldPos last_ = WorldPos::Zero();
    double heading_ = 0.0;
    int slow_steps_ = 0, tipped_steps_ = 0;
};

TEST(BulletVehicle, DrivesTenMinutesOverPagedGroundAndNeverThroughIt) {
    if (!std::filesystem::exists(raster_file())) GTEST_SKIP() << "needs " << raster_file();
    const auto source = DemHeights::open(raster_file(), {.finest_spacing = 1.5, .detail_seed = 3});
    ASSERT_TRUE(source) << source.error().message;
    Drive drive(*source);
    double least = 1e9;
    for (int i = 0; i < 36'000; ++i) {
        drive.step(i);
        const HeightAnswer at = drive.height();
        ASSERT_EQ(at.status, QueryStatus::ok) << "on absent ground in step " << i;
        const double clearance = drive.world_place().z() - at.height;
        least = std::min(least, clearance);
        ASSERT_GT(clearance, 0.0) << "through the ground in step " << i;
    }
    const PagerStats stats = drive.pager().stats();
    std::cout << "drove " << drive.distance << " m, " << stats.loaded << " chunks loaded, "
              << stats.evicted << " evicted, held " << drive.held_steps << " steps, set upright "
              << drive.resets << " times, " << drive.frames << " frames, least clearance " << least
              << " m\n";
    EXPECT_GT(drive.distance, 2000.0);
    // of the contact level one for each that a straight line of this length crosses
    EXPECT_GT(static_cast<double>(stats.loaded), drive.distance / (1.5 * kChunkCells));
    EXPECT_GT(stats.evicted, 5u);
}

}  // namespace bullet_drive_test
}  // namespace terrane
