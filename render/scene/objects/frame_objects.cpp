// SPDX-License-Identifier: MIT
#include "objects/frame_objects.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace terrane::internal {

void FrameObjects::clear() {
    ranges_.clear();
    object_count_ = 0;
    left_out_ = 0;
    occluded_ = 0;
}

void FrameObjects::begin(const View& view, float log2_least) {
    clear();
    log2_least_ = log2_least;
    eye_ = view.eye_world;
    near_ = std::max(static_cast<float>(view.near_distance), 1e-6f);
    log2_pixels_ = log2_of(static_cast<float>(view.pixels_per_radian()));
}

// Upper bound of the factors of objects (log2): the factor of an object with the largest scale and the largest radius
// at the point of their box nearest to the eye, plus a rounding margin.
float FrameObjects::largest_factor(const ObjectBounds& bounds) const {
    const Aabb& box = bounds.box_world;
    const Eigen::Vector3d nearest = eye_.cwiseMax(box.low).cwiseMin(box.high);
    const auto distance = static_cast<float>((eye_ - nearest).norm());
    // bounding spheres extend beyond the objects' boxes
    const float least = distance - bounds.most_radius;
    return log2_pixels_ + bounds.most_log_scale - log2_of(std::max(least, near_)) + 0x1p-10f;
}

// Distances are to bounding spheres: no point of an object is nearer than its sphere.
void FrameObjects::compute_factors(const ObjectCluster& cluster, std::size_t first, std::size_t end,
                                   const Eigen::Vector3f& origin_eye) {
    const float ox = origin_eye.x(), oy = origin_eye.y(), oz = origin_eye.z();
    const float *xs = cluster.x.data(), *ys = cluster.y.data(), *zs = cluster.z.data();
    const float *radii = cluster.radius.data(), *scales = cluster.log_scale.data();
    float* factors = group_factors_.data();
    for (std::size_t i = first; i < end; ++i) {
        const float dx = xs[i] + ox, dy = ys[i] + oy, dz = zs[i] + oz;
        const float distance = std::sqrt(dx * dx + dy * dy + dz * dz) - radii[i];
        factors[i - first] = log2_pixels_ + scales[i] - log2_of(std::max(distance, near_));
    }
}

// Whether none of `count` objects is drawn, because all are small or hidden by the ground; counts them.
bool FrameObjects::cull(const ObjectBounds& bounds, std::size_t count, const LevelChoice& choice,
                        const HorizonMap* horizon_map) {
    if (!choice.is_drawn(largest_factor(bounds), log2_least_)) {
        left_out_ += count;
        return true;
    }
    if (horizon_map != nullptr && horizon_map->hides(bounds.box_world)) {
        occluded_ += count;
        return true;
    }
    return false;
}

// Adds the objects of a cluster that are wanted, except small ones and those hidden by the ground.
//
// @param make_wanted for the box of a group: none if no object of it is wanted, else bool(std::size_t object)
template <class MakeWanted>
void FrameObjects::add_where(const ObjectCluster& cluster, const LevelChoice& choice,
                             const HorizonMap* horizon_map, const MakeWanted& make_wanted) {
    const std::size_t count = cluster.size(), first = object_count_;
    const Eigen::Vector3f origin_eye = to_local(cluster.origin_world, eye_);
    const auto take = [&](std::size_t from, std::size_t end, const auto& is_wanted,
                          bool may_be_hidden) {
        if (indices_.size() < first + count) {
            indices_.resize(2 * (first + count));
            factors_.resize(indices_.size());
        }
        compute_factors(cluster, from, end, origin_eye);
        for (std::size_t i = from; i < end; ++i) {
            if (!is_wanted(i)) continue;
            const float factor = group_factors_[i - from];
            if (!choice.is_drawn(factor, log2_least_)) {
                ++left_out_;
                continue;
            }
            if (may_be_hidden && horizon_map->hides(sphere_of(cluster, i))) {
                ++occluded_;
                continue;
            }
            indices_[object_count_] = static_cast<std::uint16_t>(i);
            factors_[object_count_] = factor;
            ++object_count_;
        }
    };
    take_groups(cluster, choice, horizon_map, make_wanted, take);
    if (object_count_ > first) ranges_.push_back({&cluster, origin_eye, first, object_count_});
}

void FrameObjects::add(const ObjectCluster& cluster, const LevelChoice& choice,
                       const ViewVolume& volume, const HorizonMap* horizon_map) {
    PlaneState around;
    volume.test_planes(cluster.bounds.box_world, around);
    add_where(cluster, choice, horizon_map, [&](const Aabb& box) {
        PlaneState around_group = around;
        const Containment where = volume.test_planes(box, around_group);
        const auto is_wanted = [&volume, &cluster, around_group, where](std::size_t i) {
            PlaneState state = around_group;
            return where == Containment::inside ||
                   volume.test_planes(sphere_of(cluster, i), state) != Containment::outside;
        };
        return where == Containment::outside ? std::nullopt : std::optional(is_wanted);
    });
}

void FrameObjects::add_casters(const ObjectCluster& cluster, const LevelChoice& choice,
                               const ViewVolume& volume, const CasterVolume& casters,
                               bool is_in_view) {
    // objects beyond the far plane are not drawn, not even as casters
    const PlaneState far_plane{.mask = 1 << PlaneState::kFarPlane, .first = PlaneState::kFarPlane};
    PlaneState around;
    const Containment where = volume.test_planes(cluster.bounds.box_world, around);
    if (is_in_view && where == Containment::inside) return;
    add_where(cluster, choice, nullptr, [&](const Aabb& box) {
        PlaneState around_group = around;
        const Containment of_group =
            is_in_view ? volume.test_planes(box, around_group) : Containment::outside;
        const auto is_wanted = [&volume, &casters, &cluster, far_plane, around_group,
                                of_group](std::size_t i) {
            const BoundingSphere sphere = sphere_of(cluster, i);
            PlaneState state = around_group, beyond = far_plane;
            const bool is_taken = of_group != Containment::outside &&
                                  volume.test_planes(sphere, state) != Containment::outside;
            return !is_taken && casters.meets(sphere) &&
                   volume.test_planes(sphere, beyond) != Containment::outside;
        };
        const bool is_any = of_group != Containment::inside && casters.meets(box);
        return is_any ? std::optional(is_wanted) : std::nullopt;
    });
}

void FrameObjects::count_factors(std::span<FactorCounts> counts_out) const {
    for (FactorCounts& counts : counts_out) counts.clear();
    for (const Range& range : ranges_) {
        FactorCounts& counts = counts_out[range.cluster->model];
        for (std::size_t i = range.first; i < range.end; ++i) counts.add(factors_[i]);
    }
}

namespace {

// Removes the meshes from an object's chosen levels and returns their coverage; 0 if there are none.
float remove_meshes(const ObjectModel& model, ChosenLevels& levels) {
    const auto is_mesh = [&](std::uint32_t level) {
        return level != ChosenLevels::kNone && !model.levels[level].is_impostor;
    };
    if (!is_mesh(levels.finer)) return 0.0f;
    levels.finer = ChosenLevels::kNone;
    if (!is_mesh(levels.coarser)) return std::min(levels.share, 1.0f);
    levels.coarser = ChosenLevels::kNone;
    return 1.0f;
}

}  // namespace

void DrawList::add_model(const ObjectModel& model) {
    const auto index = static_cast<std::uint32_t>(first_bucket_.size());
    first_bucket_.push_back(static_cast<std::uint32_t>(buckets_.size()));
    for (std::uint32_t level = 0; level < model.levels.size(); ++level)
        buckets_.push_back({index, level, 0, 0});
}

void DrawList::make(const FrameObjects& objects, std::span<const ObjectModel> models,
                    std::span<const LevelChoice> choices, float log2_threshold,
                    std::span<const NearObject> near, std::vector<ObjectInstance>& instances_out) {
    choose(objects, models, choices, log2_threshold, near);
    lay_out(models, instances_out);
    fill(objects, instances_out);
}

void DrawList::choose(const FrameObjects& objects, std::span<const ObjectModel> models,
                      std::span<const LevelChoice> choices, float log2_threshold,
                      std::span<const NearObject> near) {
    for (Bucket& bucket : buckets_) bucket.count = 0;
    object_count_ = 0;
    near_.clear();
    near_places_.clear();
    chosen_.resize(objects.size());
    std::size_t i = 0, next_near = 0;
    objects.visit(
        [&](const ObjectCluster& cluster, const Eigen::Vector3f&, std::size_t, float log2_factor) {
            ChosenLevels levels = choices[cluster.model].choose(log2_factor, log2_threshold);
            if (cluster.coverage != 1.0f && levels.finer != ChosenLevels::kNone) {
                // fades do not nest: one level with the coverage of the switch above
                levels.coarser = ChosenLevels::kNone;
                levels.share = cluster.coverage;
            }
            object_count_ += levels.finer != ChosenLevels::kNone ? 1 : 0;
            if (next_near < near.size() && near[next_near].place == i) {
                const float coverage = remove_meshes(models[cluster.model], levels);
                if (coverage != 0.0f) {
                    near_.push_back({.object = next_near});
                    near_places_.push_back({i, coverage});
                }
                ++next_near;
            }
            const std::uint32_t first = first_bucket_[cluster.model];
            if (levels.finer != ChosenLevels::kNone) ++buckets_[first + levels.finer].count;
            if (levels.coarser != ChosenLevels::kNone) ++buckets_[first + levels.coarser].count;
            chosen_[i++] = levels;
        });
}

void DrawList::lay_out(std::span<const ObjectModel> models,
                       std::vector<ObjectInstance>& instances_out) {
    meshes_.clear();
    impostors_.clear();
    triangle_count_ = 0;
    auto first = static_cast<std::uint32_t>(instances_out.size());
    for (Bucket& bucket : buckets_) {
        bucket.first = first;
        first += bucket.count;
        if (bucket.count == 0) continue;
        const ObjectModel& model = models[bucket.model];
        const ObjectLevel& level = model.levels[bucket.level];
        triangle_count_ += std::size_t{bucket.count} * level.triangles;
        if (level.is_impostor) {
            impostors_.push_back({*model.impostor, bucket.first, bucket.count});
        } else {
            meshes_.push_back({model.mesh, level.mesh_level, bucket.first, bucket.count});
        }
    }
    for (NearDraw& draw : near_) draw.instance = first++;
    instances_out.resize(first);
}

void DrawList::fill(const FrameObjects& objects, std::span<ObjectInstance> instances) {
    std::size_t i = 0, next_near = 0;
    objects.visit([&](const ObjectCluster& cluster, const Eigen::Vector3f& origin_eye,
                      std::size_t object, float) {
        const ChosenLevels& levels = chosen_[i];
        const auto set = [&](ObjectInstance& instance, float coverage) {
            instance = cluster.instances[object];
            for (std::size_t axis = 0; axis < 3; ++axis)
                instance.offset_eye[axis] += origin_eye[static_cast<int>(axis)];
            instance.coverage = coverage;
        };
        const auto place = [&](std::uint32_t level, float coverage) {
            if (level == ChosenLevels::kNone) return;
            set(instances[buckets_[first_bucket_[cluster.model] + level].first++], coverage);
        };
        place(levels.finer, levels.share);
        place(levels.coarser, levels.share - 1.0f);
        if (next_near < near_.size() && near_places_[next_near].place == i) {
            set(instances[near_[next_near].instance], near_places_[next_near].coverage);
            ++next_near;
        }
        ++i;
    });
}

}  // namespace terrane::internal
