// SPDX-License-Identifier: MIT
#include "world/crates.h"

#include "options/option_values.h"
#include "world/body_random.h"

#include <terrane/collision/ground_contact.h>
#include <terrane/terrain/height_source.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace terrane::tools {
namespace {

constexpr std::size_t kMostCrates = 10'000;
constexpr double kLeastHalf = 0.2, kGreatestHalf = 0.5;            // half extents, metres
constexpr double kLeastDensity = 100.0, kGreatestDensity = 400.0;  // kg/m^3
constexpr double kLane = 1.0;         // distance from the path of crates on it, metres
constexpr double kLeastBeside = 5.0;  // least half width of the strip of the others, metres
constexpr double kAreaOfOne = 8.0;    // least area of the strip for one crate, m^2
constexpr double kApart = 0.2;        // least gap of the crates' bounding discs, metres
constexpr double kGentle = 0.906;     // cosine of the slope from which other places are preferred
constexpr int kTries = 64;            // places tried for a crate

double strip_half_width(const CrateLayout& layout) {
    const double area = kAreaOfOne * static_cast<double>(layout.count);
    return std::max(kLeastBeside, 0.5 * area / layout.path.length());
}

/// The point at a distance along the path and another to its left.
Eigen::Vector2d point_beside(const Polyline& path, double along, double left) {
    const Eigen::Vector2d direction = path.direction(along);
    return path.at(along) + left * Eigen::Vector2d(-direction.y(), direction.x());
}

/// A pose with a side on the plane of the ground, turned about its normal.
Pose pose_on(const HeightAnswer& at, const Eigen::Vector2d& p_world, double yaw, double half) {
    const Eigen::Vector3d along =
        Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0).cross(at.normal).normalized();
    Pose pose;
    pose.rotation << along, at.normal.cross(along), at.normal;
    pose.translation = WorldPos(p_world.x(), p_world.y(), at.height) + half * at.normal;
    return pose;
}

/// Places one crate after the other.
class CratePlacer {
public:
    CratePlacer(const CrateLayout& layout, const Ground& ground, const World& obstacles)
        : layout_(layout),
          ground_(ground),
          obstacles_(obstacles),
          half_width_(strip_half_width(layout)) {}

    /// False where no place is found.
    bool place(std::size_t index) {
        BodyRandom random(layout_.seed, index);
        PlacedBody crate;
        const Eigen::Vector3d half(random.within(kLeastHalf, kGreatestHalf),
                                   random.within(kLeastHalf, kGreatestHalf),
                                   random.within(kLeastHalf, kGreatestHalf));
        crate.settings.shape = Box{half};
        crate.settings.mass = 8.0 * half.prod() * random.within(kLeastDensity, kGreatestDensity);
        for (int i = 0; i < kTries; ++i) {
            const double beside = index % 4 == 0 && i < kTries / 2 ? kLane : half_width_;
            const double along = random.within(0.0, layout_.path.length());
            const double left = random.within(-beside, beside);
            const double yaw = random.within(0.0, 6.283185307179586);
            const Eigen::Vector2d p_world = point_beside(layout_.path, along, left);
            if (!has_room(p_world, half.norm())) continue;
            const HeightAnswer at = ground_.height(p_world.x(), p_world.y());
            has_absent_ground_ = has_absent_ground_ || at.status == GroundStatus::not_resident;
            if (at.status != GroundStatus::ok) continue;
            if (i < kTries / 2 && at.normal.z() < kGentle) continue;
            Pose pose = pose_on(at, p_world, yaw, half.z());
            const LiftAnswer answer = compute_lift(crate.settings.shape, pose, ground_);
            if (answer.status != QueryStatus::complete || !std::isfinite(answer.lift)) continue;
            pose.translation.z() += answer.lift;
            if (!is_free(obstacles_, ground_, crate.settings.shape, pose)) continue;
            crate.state.pose = pose;
            discs_.push_back({p_world, half.norm()});
            crates_.push_back(crate);
            return true;
        }
        return false;
    }

    std::vector<PlacedBody>& crates() { return crates_; }
    bool has_absent_ground() const { return has_absent_ground_; }

private:
    struct Disc {
        Eigen::Vector2d centre_world;
        double radius = 0.0;
    };

    bool has_room(const Eigen::Vector2d& p_world, double radius) const {
        const Eigen::Vector2d start = layout_.path.points().front();
        if ((p_world - start).norm() < layout_.start_radius + radius) return false;
        return std::none_of(discs_.begin(), discs_.end(), [&](const Disc& disc) {
            const double apart = disc.radius + radius + kApart;
            return (disc.centre_world - p_world).squaredNorm() < apart * apart;
        });
    }

    const CrateLayout& layout_;
    const Ground& ground_;
    const World& obstacles_;
    double half_width_ = 0.0;
    bool has_absent_ground_ = false;
    std::vector<Disc> discs_;
    std::vector<PlacedBody> crates_;
};

}  // namespace

void add_crates_option(CLI::App& app, std::size_t& count) {
    add_count(app, "--crates", count, 0,
              "Boxes of random size and mass on and beside the path, at rest on the ground; the "
              "terrain's --seed lays them out",
              kMostCrates);
}

std::vector<BodyNeed> crate_needs(const CrateLayout& layout, const HeightSource& source) {
    std::vector<BodyNeed> needs;
    if (layout.count == 0) return needs;
    const double half_width = strip_half_width(layout);
    const double radius = 1.5 * half_width + 2.0 * kGreatestHalf;
    for (double along = 0.0;; along += half_width) {
        const Eigen::Vector2d p = layout.path.at(along);
        needs.push_back(
            {.centre_world = {p.x(), p.y(), source.height(p.x(), p.y())}, .radius = radius});
        if (along >= layout.path.length()) return needs;
    }
}

CommandResult<std::vector<PlacedBody>> lay_out_crates(const CrateLayout& layout,
                                                      const Ground& ground,
                                                      const World& obstacles) {
    CratePlacer placer(layout, ground, obstacles);
    for (std::size_t i = 0; i < layout.count; ++i) {
        if (placer.place(i)) continue;
        if (placer.has_absent_ground()) {
            return failure(
                fmt::format("the ground along the path, where {} crates are placed, does not fit "
                            "in --memory-mb",
                            layout.count));
        }
        return failure(
            fmt::format("only {} of {} crates find free ground along the path", i, layout.count));
    }
    return std::move(placer.crates());
}

}  // namespace terrane::tools
