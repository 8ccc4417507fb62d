// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "base/vector_math.h"

#include <terrane/base/text.h>
#include <terrane/scene/object_model.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace {

using internal::AabbNode;

// Margin of boxes relative to the largest coordinate, above the rounding of their tests.
constexpr double kBoxMargin = 0x1p-45;

/// The transformation that maps a segment to the z axis from 0 to 1: a permutation of the axes and a shear.
class SegmentAxes {
public:
    SegmentAxes(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement) : from_(from) {
        displacement.cwiseAbs().maxCoeff(&z_);
        x_ = (z_ + 1) % 3;
        y_ = (z_ + 2) % 3;
        shear_x_ = displacement[x_] / displacement[z_];
        shear_y_ = displacement[y_] / displacement[z_];
        scale_ = 1.0 / displacement[z_];
    }

    Eigen::Vector3d operator()(const Eigen::Vector3d& p) const {
        const Eigen::Vector3d q = p - from_;
        return {q[x_] - shear_x_ * q[z_], q[y_] - shear_y_ * q[z_], scale_ * q[z_]};
    }

private:
    Eigen::Vector3d from_;
    int x_ = 0, y_ = 0, z_ = 0;
    double shear_x_ = 0.0, shear_y_ = 0.0, scale_ = 0.0;
};

/// Fraction at which the segment hits a triangle; infinity if it misses.
double meet(const SegmentAxes& axes, const std::array<Eigen::Vector3d, 3>& corners) {
    const Eigen::Vector3d a = axes(corners[0]), b = axes(corners[1]), c = axes(corners[2]);
    const double u = c.x() * b.y() - c.y() * b.x();
    const double v = a.x() * c.y() - a.y() * c.x();
    const double w = b.x() * a.y() - b.y() * a.x();
    const bool has_negative = u < 0.0 || v < 0.0 || w < 0.0;
    const bool has_positive = u > 0.0 || v > 0.0 || w > 0.0;
    if (has_negative == has_positive) return internal::kInfinity;
    const double fraction = (u * a.z() + v * b.z() + w * c.z()) / (u + v + w);
    return fraction >= 0.0 && fraction <= 1.0 ? fraction : internal::kInfinity;
}

}  // namespace

struct MeshRays::Data {
    std::vector<std::array<Eigen::Vector3d, 3>> corners;  // [triangles]
    std::vector<AabbNode> tree;
    double largest_coordinate = 0.0;
};

MeshRays::MeshRays(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

Result<MeshRays> MeshRays::create(const TriangleMesh& mesh) {
    TERRANE_TRY(mesh.validate());
    auto data = std::make_shared<Data>();
    std::vector<Aabb> boxes;
    for (const TriangleMesh::Triangle& triangle : mesh.triangles) {
        std::array<Eigen::Vector3d, 3>& corners = data->corners.emplace_back();
        Aabb& box = boxes.emplace_back(internal::empty_box());
        for (std::size_t i = 0; i < 3; ++i) {
            corners[i] = mesh.positions[triangle[i]];
            internal::include(corners[i], 0.0, box);
            data->largest_coordinate =
                std::max(data->largest_coordinate, corners[i].cwiseAbs().maxCoeff());
        }
    }
    data->tree = internal::make_aabb_tree(boxes);
    return MeshRays(std::move(data));
}

std::optional<MeshHit> MeshRays::ray(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    const Eigen::Vector3d displacement = to - from;
    if (!displacement.allFinite() || displacement == Eigen::Vector3d::Zero()) return std::nullopt;
    const double margin =
        kBoxMargin * std::max(data_->largest_coordinate, from.cwiseAbs().maxCoeff());
    const SegmentAxes axes(from, displacement);
    MeshHit hit;
    hit.fraction = internal::kInfinity;
    internal::visit_leaves_up_to(
        data_->tree, 1.0,
        [&](const Aabb& box) { return internal::segment_entry(from, displacement, box, margin); },
        [&](std::uint32_t triangle) {
            const double fraction = meet(axes, data_->corners[triangle]);
            if (fraction < hit.fraction ||
                (fraction == hit.fraction && triangle < hit.triangle && fraction <= 1.0)) {
                hit.fraction = fraction;
                hit.triangle = triangle;
            }
            return std::min(hit.fraction, 1.0);
        });
    if (!(hit.fraction <= 1.0)) return std::nullopt;
    const auto& [a, b, c] = data_->corners[hit.triangle];
    const Eigen::Vector3d normal = internal::cross(b - a, c - a);
    const double size = internal::length(normal);
    if (size > 0.0) hit.normal = normal / size;
    if (internal::dot(hit.normal, displacement) > 0.0) hit.normal = -hit.normal;
    return hit;
}

namespace {

Result<void> check_level(const ObjectModel& model, std::size_t i) {
    const ObjectLevel& level = model.levels[i];
    const auto refuse = [&](const std::string& message) {
        return fail(ErrorCode::invalid_argument, message + " in level " + number_text(i));
    };
    if (!(level.error_m >= 0.0) || !std::isfinite(level.error_m)) {
        return refuse("error_m must be at least 0 and finite, got " + number_text(level.error_m));
    }
    if (level.triangles == 0) return refuse("triangles must be at least 1, got 0");
    if (level.is_impostor && !model.impostor) return refuse("there is no impostor for it");
    const bool has_next = i + 1 < model.levels.size();
    if (level.morphs && (level.is_impostor || !has_next || model.levels[i + 1].is_impostor))
        return refuse("morphs needs a mesh and another mesh as the next level");
    if (i == 0) return {};
    const ObjectLevel& finer = model.levels[i - 1];
    if (!(level.error_m > 0.0 && level.error_m >= kLeastLevelRatio * finer.error_m)) {
        return refuse("error_m must be above 0 and at least twice the one before, got " +
                      number_text(level.error_m) + " after " + number_text(finer.error_m));
    }
    if (level.triangles >= finer.triangles) {
        return refuse("triangles must decrease, got " + number_text(level.triangles) + " after " +
                      number_text(finer.triangles));
    }
    return {};
}

Result<void> check_continuous(const ObjectModel& model) {
    const std::size_t triangles = model.continuous->step_triangle_counts().front();
    if (model.levels[0].is_impostor || model.levels[0].triangles != triangles) {
        return fail(ErrorCode::invalid_argument,
                    "continuous must have the triangles of the finest level, a mesh, got " +
                        number_text(triangles));
    }
    for (std::size_t i = 1; i < model.levels.size(); ++i) {
        if (model.levels[i].is_impostor || !model.levels[i - 1].is_impostor) continue;
        return fail(ErrorCode::invalid_argument,
                    "with continuous no mesh may come after an impostor, got one in level " +
                        number_text(i));
    }
    return {};
}

}  // namespace

Result<void> ObjectModel::validate() const {
    const Aabb& box = bounds;
    if (!box.low.allFinite() || !box.high.allFinite() ||
        !(box.low.array() <= box.high.array()).all()) {
        return fail(ErrorCode::invalid_argument, "bounds must be finite, low at most high");
    }
    if (levels.empty()) {
        return fail(ErrorCode::invalid_argument, "a model must have at least one level, got 0");
    }
    for (std::size_t i = 0; i < levels.size(); ++i) {
        TERRANE_TRY(check_level(*this, i));
    }
    if (continuous != nullptr) {
        TERRANE_TRY(check_continuous(*this));
    }
    const double last = levels.back().error_m;
    if (!(absence_error_m > 0.0 && absence_error_m >= kLeastLevelRatio * last)) {
        return fail(
            ErrorCode::invalid_argument,
            "absence_error_m must be above 0 and at least twice the last level's error, got " +
                number_text(absence_error_m));
    }
    return {};
}

}  // namespace terrane
