// SPDX-License-Identifier: MIT
#include "replay.h"

#include "benchmark/mesh/mesh_copy.h"
#include "benchmark/mesh/mesh_locator.h"
#include "support/mesh_checks.h"
#include "support/random.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

namespace terrane::bench {
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
