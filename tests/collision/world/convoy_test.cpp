// SPDX-License-Identifier: MIT
//
// Twenty vehicles drive laps among five hundred crates and between rails, on ground that is paged meanwhile, for
// TERRANE_CONVOY_SECONDS.
#include "collision/world/body_cases.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#ifdef TERRANE_TEST_DEM
#include <terrane/dem/dem_heights.h>
#endif

namespace terrane::convoy_test {

using namespace test;

constexpr double kRadius = 300.0;  // of the laps, metres
constexpr std::size_t kVehicles = 20, kCrates = 500, kRails = 330;
constexpr double kRailDistance = 9.0;  // beyond the laps, metres

/// Gentle ground with 1 m cells; the laps cross many of its chunks.
std::shared_ptr<const HeightSource> make_fractal() {
    return FractalHeights::create({.seed = 23,
                                   .amplitude = 60.0,
                                   .wavelength_log2 = 10,
                                   .gain = 0.4,
                                   .root_size_log2 = 12})
        .value();
}

/// A point of the lap at an angle, `outside` metres beyond its centre line.
Eigen::Vector2d on_round(double angle, double outside) {
    const double radius = kRadius + outside;
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

class Convoy {
public:
    explicit Convoy(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)),
          pager_(Pager::create(source_, {.memory_bytes = 24 << 20, .worker_count = 0}).value()) {
        Random random(23);
        const double turn = 2.0 * std::numbers::pi;
        for (std::size_t i = 0; i < kVehicles; ++i) {
            const double angle = turn * static_cast<double>(i) / kVehicles;
            Pose pose{.translation = place_at(on_round(angle, 0.0), 1.6)};
            pose.rotation << -std::sin(angle), -std::cos(angle), 0.0, std::cos(angle),
                -std::sin(angle), 0.0, 0.0, 0.0, 1.0;
            const VehicleSettings kinds[] = {make_truck(), make_tracked(), make_six_wheeler()};
            vehicles_.push_back(world_.add_vehicle(kinds[i % 3], pose).value());
            std::vector<Eigen::Vector2d> rounds;
            for (int k = 1; k < 600; ++k) rounds.push_back(on_round(angle + 0.05 * k, 0.0));
            drivers_.push_back(
                PathDriver::create(std::move(rounds), {.cruise_speed = 10.0}).value());
        }
        for (std::size_t i = 0; i < kCrates; ++i) {
            // None on a vehicle's start position.
            const double gap = turn / kVehicles;
            const double angle =
                gap * (static_cast<double>(i % kVehicles) + random.between(0.2, 0.8));
            const double half = random.between(0.2, 0.5);
            const BodySettings crate{.shape = Box{{half, half, half}},
                                     .mass = 150.0 * half * half * half * 8.0};
            const Eigen::Vector2d place = on_round(angle, random.between(-3.0, 3.0));
            crates_.push_back(add(world_, crate, at(place_at(place, half + 0.1))));
        }
        for (std::size_t i = 0; i < kRails; ++i) {
            rails_.push_back(add_rail(turn * static_cast<double>(i) / kRails));
        }
    }

    StepReport step(double time) {
        pager_.update({}, world_.needs(), time);
        for (std::size_t i = 0; i < kVehicles; ++i) {
            const VehicleState& state = *world_.vehicle(vehicles_[i]);
            EXPECT_TRUE(world_.set_controls(
                vehicles_[i],
                drivers_[i].drive(*world_.vehicle_settings(vehicles_[i]), state, kStep)));
        }
        const StepReport report = world_.step(pager_.ground(), kStep);
        watch_rolls(time);
        return report;
    }

    /// Vehicles that have come to rest on their side or roof, and those of them that had touched no other body.
    std::size_t rolled_over() const { return rolled_over_; }
    std::size_t rolled_over_alone() const { return rolled_over_alone_; }
    /// Vehicles that have touched a crate or a rail.
    std::ptrdiff_t touched() const {
        return std::ranges::count_if(touched_, [](double time) { return time > 0.0; });
    }

    /// Deepest overlap of a vehicle with a rail or a crate, metres.
    double deepest_overlap() const {
        double deepest = 0.0;
        for (const BodyId vehicle : vehicles_) {
            for (const std::vector<BodyId>* others : {&rails_, &crates_}) {
                for (const BodyId other : *others) {
                    const Pose &a = world_.state(vehicle).pose, &b = world_.state(other).pose;
                    if ((a.translation - b.translation).norm() > 15.0) continue;
                    const double distance = signed_distance(world_.settings(vehicle).shape, a,
                                                            world_.settings(other).shape, b)
                                                .distance;
                    deepest = std::max(deepest, -distance);
                }
            }
        }
        return deepest;
    }

    /// Distance of the outermost vehicle from the centre of the laps, metres.
    double farthest() const {
        double farthest = 0.0;
        for (const BodyId vehicle : vehicles_) {
            farthest = std::max(farthest, world_.state(vehicle).pose.translation.head<2>().norm());
        }
        return farthest;
    }

private:
    /// Counts vehicles that have rolled over, separately if they touched no other body in the seconds before.
    void watch_rolls(double time) {
        constexpr double kBefore = 5.0;  // seconds
        for (std::size_t i = 0; i < kVehicles; ++i) {
            const VehicleState& vehicle = *world_.vehicle(vehicles_[i]);
            const bool touches =
                std::ranges::any_of(
                    vehicle.wheels,
                    [](const WheelState& wheel) { return wheel.body.is_valid(); }) ||
                std::ranges::any_of(world_.contact_events(), [&](const ContactEvent& event) {
                    return !event.is_ground() &&
                           (event.a == vehicles_[i] || event.b == vehicles_[i]);
                });
            if (touches) touched_[i] = time;
            if (vehicle.is_rolled_over && !was_over_[i]) {
                ++rolled_over_;
                if (time - touched_[i] > kBefore) ++rolled_over_alone_;
            }
            was_over_[i] = vehicle.is_rolled_over;
        }
    }

    /// A rail along the ground beyond the lap.
    BodyId add_rail(double angle) {
        constexpr double kHalfLength = 3.0, kHalfHeight = 1.0, kAbove = 0.7;
        constexpr double kHalfAngle = kHalfLength / (kRadius + kRailDistance);
        BodyState state = at(place_at(on_round(angle, kRailDistance), kAbove));
        const WorldPos before = place_at(on_round(angle - kHalfAngle, kRailDistance), kAbove);
        const WorldPos after = place_at(on_round(angle + kHalfAngle, kRailDistance), kAbove);
        const Eigen::Vector3d along = (after - before).normalized();
        const Eigen::Vector3d across(std::cos(angle), std::sin(angle), 0.0);
        state.pose.rotation << across, along, across.cross(along);
        const Shape shape = Box{{0.1, kHalfLength + 0.1, kHalfHeight}};
        return add(world_, {.shape = shape, .type = BodyType::static_body}, state);
    }

    WorldPos place_at(const Eigen::Vector2d& p, double above) const {
        return {p.x(), p.y(), source_->height(p.x(), p.y()) + above};
    }

    std::shared_ptr<const HeightSource> source_;
    Pager pager_;
    World world_ = make_world({.report_contacts = true});
    std::vector<BodyId> vehicles_, crates_, rails_;
    std::vector<PathDriver> drivers_;
    std::array<double, kVehicles> touched_{};  // time of the last contact with another body, s
    std::array<bool, kVehicles> was_over_{};
    std::size_t rolled_over_ = 0, rolled_over_alone_ = 0;
};

void drive_rounds(std::shared_ptr<const HeightSource> source) {
    const double seconds = number_from("TERRANE_CONVOY_SECONDS", 5.0);
    Convoy convoy(std::move(source));
    std::uint64_t parked = 0, awake = 0;
    double lost = 0.0, lived = 0.0, deepest = 0.0;
    for (int step = 0; step * kStep < seconds; ++step) {
        const StepReport report = convoy.step(step * kStep);
        ASSERT_EQ(report.too_deep, 0u) << "step " << step;
        parked += report.parked;
        awake += report.awake;
        lost += report.lost_time;
        lived += report.simulated_time;
        if (step % 30 == 0) deepest = std::max(deepest, convoy.deepest_overlap());
    }
    std::printf(
        "%.0f s: %llu awake body steps, %llu parked, %.3g %% lost, overlaps to %.3g m, %zu "
        "rolled over, farthest %.1f m\n",
        seconds, static_cast<unsigned long long>(awake), static_cast<unsigned long long>(parked),
        100.0 * lost / (lost + lived), deepest, convoy.rolled_over(), convoy.farthest());
    EXPECT_EQ(parked, 0u);
    EXPECT_GE(convoy.touched(), 10) << "vehicles that met a crate";
    EXPECT_EQ(convoy.rolled_over_alone(), 0u);
    EXPECT_LT(convoy.farthest(), kRadius + kRailDistance) << "through a rail";
    EXPECT_LT(deepest, 0.2);
}

TEST(Convoy, TwentyVehiclesAmongFiveHundredCratesPassThroughNothing) {
    drive_rounds(make_fractal());
}

#ifdef TERRANE_TEST_DEM
TEST(Convoy, OnSurveyedGroundPassesThroughNothing) {
    const char* const folder = std::getenv("TERRANE_DATA");
    const std::string file = (folder != nullptr ? folder : TERRANE_SOURCE_DIR "/../shared/data") +
                             std::string("/dem/gabilan_lidar_1m.tif");
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "needs " << file;
    const Result<std::shared_ptr<const HeightSource>> source = DemHeights::open(file, {});
    ASSERT_TRUE(source) << source.error().message;
    drive_rounds(*source);
}
#endif

}  // namespace terrane::convoy_test
