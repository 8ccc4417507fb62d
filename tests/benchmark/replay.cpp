// SPDX-License-Identifier: MIT
#include "benchmark/replay.h"

#include "benchmark/mesh_measure.h"
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>

namespace terrane::bench {
namespace {

constexpr double kSpeed = 100.0;
constexpr double kFramesPerSecond = 60.0;
constexpr double kAltitude = 100.0;
constexpr double kPitch = -10.0 * std::numbers::pi / 180.0;
constexpr double kHeading = 0.6;  // radians from east
constexpr double kTurnRate = 0.5 * std::numbers::pi;

template <class T>
T value_or_exit(Result<T> result) {
    if (result) return std::move(*result);
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::exit(1);
}

// Weighted mean of the ground 200 m around, along the flight.
double smooth_ground(const HeightSource& source, double x, double y) {
    double sum = 0.0, weights = 0.0;
    for (int i = -20; i <= 20; ++i) {
        const double weight = 21.0 - std::abs(i);
        sum += weight *
               source.height(x + 10.0 * i * std::cos(kHeading), y + 10.0 * i * std::sin(kHeading));
        weights += weight;
    }
    return sum / weights;
}

}  // namespace

BenchmarkGround make_map_ground(int side) {
    BenchmarkGround ground;
    ground.name = "fBm map " + std::to_string(side) + "^2, 1 m";
    ground.table = std::make_shared<const test::TableHeights>(test::make_fbm_table(side));
    ground.source = ground.table;
    ground.start_x = 0.25 * side;
    ground.start_y = 0.3 * side;
    ground.far_m = side;
    return ground;
}

BenchmarkGround make_fractal_ground() {
    BenchmarkGround ground;
    ground.name = "fractal, 2097 km, 12.5 cm";
    ground.source =
        value_or_exit(FractalHeights::create({.finest_spacing_log2 = -3, .root_size_log2 = 20}));
    ground.start_x = 3000.0;
    ground.start_y = 2000.0;
    ground.far_m = 30'000.0;
    return ground;
}

View flight_view(const BenchmarkGround& ground, const FlightPlan& plan, int frame) {
    const double distance = kSpeed / kFramesPerSecond * frame;
    const double x = ground.start_x + distance * std::cos(kHeading);
    const double y = ground.start_y + distance * std::sin(kHeading);
    const double turned =
        kTurnRate / kFramesPerSecond * std::max(0, frame - plan.straight_frames + 1);
    const WorldPos eye(x, y, smooth_ground(*ground.source, x, y) + kAltitude);
    const Eigen::Vector3d ahead(std::cos(kHeading + turned) * std::cos(kPitch),
                                std::sin(kHeading + turned) * std::cos(kPitch), std::sin(kPitch));
    return value_or_exit(look_at(eye, eye + 1000.0 * ahead, std::numbers::pi / 3.0, 1920, 1080));
}

TriangulatorSettings settings_for(std::size_t triangles, int threads) {
    // a target that no budget reaches, so that the budget decides
    TriangulatorSettings settings;
    settings.triangle_budget = triangles;
    settings.max_error_px = 1e-3;
    settings.worker_count = threads;
    return settings;
}

TerrainMesh settle(Pager& pager, Triangulator& triangulator, const View& view, double time_s) {
    double wanted = 256.0;
    for (;;) {
        const CameraNeed camera{.view = view, .threshold_px = wanted};
        pager.update({&camera, 1}, {}, time_s);
        pager.finish();
        const TerrainMesh mesh = triangulator.update(pager.resident(), view);
        if (mesh.threshold_px >= wanted || wanted < 1e-6) return mesh;
        wanted = std::max(mesh.threshold_px, 0.5 * wanted);
    }
}

std::vector<FlightFrame> fly(const BenchmarkGround& ground, const FlightPlan& plan,
                             const TriangulatorSettings& settings, std::size_t memory_bytes,
                             Clock clock) {
    Pager pager = value_or_exit(
        Pager::create(ground.source, {.memory_bytes = memory_bytes, .worker_count = 0}));
    Triangulator triangulator = value_or_exit(Triangulator::create(*ground.source, settings));
    // the frame before the first, so that the first one follows something
    View view = flight_view(ground, plan, -1);
    double threshold_px = settle(pager, triangulator, view, 0.0).threshold_px;
    std::vector<FlightFrame> frames;
    for (int frame = 0; frame < plan.frames(); ++frame) {
        FlightFrame made;
        made.view = flight_view(ground, plan, frame);
        const Eigen::Vector3d velocity = kFramesPerSecond * (made.view.eye_world - view.eye_world);
        view = made.view;
        const CameraNeed camera{.view = view, .velocity = velocity, .threshold_px = threshold_px};
        pager.update({&camera, 1}, {}, (frame + 1) / kFramesPerSecond);
        made.resident = pager.resident();
        const Stopwatch watch(clock);
        const TerrainMesh mesh = triangulator.update(made.resident, view);
        made.ms = watch.ms();
        made.triangles = mesh.triangle_count;
        made.error_px = mesh.error_px;
        threshold_px = mesh.threshold_px;
        frames.push_back(std::move(made));
    }
    return frames;
}

namespace {

constexpr double kMostPopPx = 0.5;
constexpr double kBoundedErrorPx = 1.5;
constexpr double kNearestPoint = 20.0;  // metres

struct Frame {
    MeshCopy mesh;
    std::unique_ptr<MeshLocator> locator;
};

// True points of the ground inside the side planes, as many near as far.
std::vector<Eigen::Vector3d> points_in_view(const BenchmarkGround& ground, const View& view,
                                            int count, test::Random& random) {
    const Frustum frustum = make_frustum(view);
    const double heading = std::atan2(view.forward.y(), view.forward.x());
    const double spread = std::numbers::pi / 3.0;  // more than half the picture's width
    std::vector<Eigen::Vector3d> points;
    for (int tries = 0; tries < 50 * count && static_cast<int>(points.size()) < count; ++tries) {
        const double distance =
            kNearestPoint * std::pow(ground.far_m / kNearestPoint, random.between(0.0, 1.0));
        const double angle = heading + random.between(-spread, spread);
        const double x = view.eye_world.x() + distance * std::cos(angle);
        const double y = view.eye_world.y() + distance * std::sin(angle);
        if (!ground.source->extent().contains(x, y)) continue;
        const Eigen::Vector3d point(x, y, ground.source->height(x, y));
        const Eigen::Vector3d from_eye = point - view.eye_world;
        if (std::ranges::all_of(frustum.normals, [&](const Eigen::Vector3d& normal) {
                return normal.dot(from_eye) >= 0.0;
            })) {
            points.push_back(point);
        }
    }
    return points;
}

double pixels_at(const View& view, const Eigen::Vector3d& point) {
    return view.pixels_per_radian() / std::max(view.near_distance, (point - view.eye_world).norm());
}

class Judge {
public:
    Judge(const BenchmarkGround& ground, const TriangulatorSettings& settings,
          const ReplaySettings& how)
        : ground_(ground), settings_(settings), how_(how), random_(how.seed) {}

    Frame keep(const TerrainMesh& mesh) const {
        Frame frame{MeshCopy(mesh), nullptr};
        frame.locator = std::make_unique<MeshLocator>(frame.mesh.view(), ground_.source->lattice());
        return frame;
    }

    void look(int number, const FlightFrame& asked, const Frame& frame) {
        ++report.checked;
        const TerrainMesh mesh = frame.mesh.view();
        TriangulatorSettings alone = settings_;  // on one thread, whatever made the frame
        alone.worker_count = 1;
        Triangulator fresh = Triangulator::create(*ground_.source, alone).value();
        const std::string difference =
            find_difference(fresh.update(asked.resident, asked.view), mesh);
        if (!difference.empty())
            fault(report.not_reproduced, number, "from scratch: " + difference);
        const std::string flaw = test::find_flaw(test::make_soup(mesh), ground_.source->lattice());
        if (!flaw.empty()) fault(report.flawed, number, flaw);
        if (frame.locator->stray_count() > 0) fault(report.flawed, number, "stray triangles");

        double measured = 0.0;
        points_ = points_in_view(ground_, asked.view, how_.points, random_);
        for (const Eigen::Vector3d& point : points_) {
            const std::optional<double> shown =
                frame.locator->displayed_height(point.x(), point.y());
            if (!shown) {
                fault(report.flawed, number, "no triangle over a point");
                return;
            }
            measured =
                std::max(measured, std::abs(*shown - point.z()) * pixels_at(asked.view, point));
        }
        report.points += points_.size();
        if (measured > mesh.error_px) {
            fault(
                report.uncertified, number,
                "measured " + std::to_string(measured) + " px of " + std::to_string(mesh.error_px));
        }
        if (mesh.error_px > 0.0) {
            report.worst_ratio = std::max(report.worst_ratio, measured / mesh.error_px);
        }
    }

    // Of the points of the last look() that were in view before, too.
    void compare(int number, const FlightFrame& asked, const Frame& frame,
                 const FlightFrame& asked_before, const Frame& before) {
        const Frustum frustum = make_frustum(asked_before.view);
        const double moved = (asked.view.eye_world - asked_before.view.eye_world).norm();
        const bool is_bounded =
            std::max(frame.mesh.view().error_px, before.mesh.view().error_px) <= kBoundedErrorPx;
        report.bounded_frames += is_bounded ? 1 : 0;
        for (const Eigen::Vector3d& point : points_) {
            const Eigen::Vector3d from_eye = point - asked_before.view.eye_world;
            if (std::ranges::any_of(frustum.normals, [&](const Eigen::Vector3d& normal) {
                    return normal.dot(from_eye) < 0.0;
                })) {
                continue;
            }
            const auto now = frame.locator->displayed_height(point.x(), point.y());
            const auto then = before.locator->displayed_height(point.x(), point.y());
            if (!now || !then) continue;  // counted as a flaw
            const double move = std::abs(*now - *then) * pixels_at(asked.view, point);
            const double distance = (point - asked.view.eye_world).norm();
            if (!is_bounded || moved >= 0.1 * distance) {
                report.worst_move_px = std::max(report.worst_move_px, move);
                continue;
            }
            report.worst_pop_px = std::max(report.worst_pop_px, move);
            if (move <= kMostPopPx) continue;
            if (report.pops++ == 0) note(number, "moved by " + std::to_string(move) + " px");
        }
    }

    void fault(int& count, int number, const std::string& what) {
        ++count;
        note(number, what);
    }

    ReplayReport report;

private:
    void note(int number, const std::string& what) {
        if (!report.first_fault.empty()) return;
        report.first_fault = "frame " + std::to_string(number) + ": " + what;
    }

    const BenchmarkGround& ground_;
    const TriangulatorSettings& settings_;
    const ReplaySettings& how_;
    test::Random random_;
    std::vector<Eigen::Vector3d> points_;
};

}  // namespace

ReplayReport replay(const BenchmarkGround& ground, const TriangulatorSettings& settings,
                    const std::vector<FlightFrame>& frames, const ReplaySettings& how) {
    Judge judge(ground, settings, how);
    Triangulator triangulator = Triangulator::create(*ground.source, settings).value();
    Frame before;
    int before_number = -1;
    const int count = static_cast<int>(frames.size());
    for (int number = 0; number < count; ++number) {
        const FlightFrame& asked = frames[static_cast<std::size_t>(number)];
        const TerrainMesh mesh = triangulator.update(asked.resident, asked.view);
        ++judge.report.frames;
        if (mesh.triangle_count > settings.triangle_budget ||
            mesh.indices.size() < 3 * mesh.triangle_count) {
            judge.fault(judge.report.over_budget, number,
                        std::to_string(mesh.triangle_count) + " triangles");
        }
        if (mesh.triangle_count != asked.triangles || mesh.error_px != asked.error_px) {
            judge.fault(judge.report.not_reproduced, number,
                        "another mesh than in the timed flight");
        }
        const bool is_checked = number % how.check_every == 0;
        const bool is_followed = (number + 1) % how.check_every == 0;
        if (!is_checked && !is_followed) continue;
        Frame frame = judge.keep(mesh);
        if (is_checked) {
            judge.look(number, asked, frame);
            if (before_number >= 0 && before_number == number - 1) {
                judge.compare(number, asked, frame, frames[static_cast<std::size_t>(number - 1)],
                              before);
            }
        }
        before = std::move(frame);
        before_number = number;
    }
    return judge.report;
}

}  // namespace terrane::bench
