// SPDX-License-Identifier: MIT
#pragma once

#include "objects/level_choice.h"

#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>

#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Names an object of a scene for as long as its group is there.
struct ObjectKey {
    std::uint64_t cluster_order = 0;  ///< ObjectCluster::order, which is not given twice
    std::uint32_t index = 0;          ///< in the cluster
    auto operator<=>(const ObjectKey&) const = default;
};

/// An object of a frame that may have a level of its own.
struct NearObject {
    ObjectKey key;
    std::uint32_t model = 0;
    std::size_t place = 0;     ///< among all objects of the frame
    float log2_factor = 0.0f;  ///< of pixels per metre of error at scale 1
};

/// The nearest of the objects in view: those with the most pixels a metre of their models. One that was near stays
/// until another one has an eighth more, so that equally near ones do not take turns.
class NearObjects {
public:
    /// @param most objects, above 0
    explicit NearObjects(std::size_t most) : most_(most) {}

    /// Begins a frame without candidates.
    void clear() { objects_.clear(); }
    /// Adds a candidate; they come in the order of their keys, which is that of their places.
    void add(const NearObject& object) { objects_.push_back(object); }
    /// Keeps the nearest candidates, in the same order. Ties are decided by keys.
    ///
    /// Cost: O(candidates)
    void select();

    /// The candidates, after select() the nearest of them.
    std::span<const NearObject> objects() const { return objects_; }

private:
    struct Ranked {
        float nearness;
        std::uint32_t candidate;
    };

    std::size_t most_;
    std::vector<NearObject> objects_;
    std::vector<ObjectKey> were_near_;  // of the last selection, ascending
    std::vector<Ranked> ranked_;        // scratch
};

/// The triangles of near objects: each has a level of its own, which is kept from frame to frame and changed by the
/// contractions between two levels.
class ContinuousLevels {
public:
    /// Adds the next model, whose number is how many there were before.
    void add_model(const ObjectModel& model) { models_.push_back({model.continuous, {}}); }

    /// From now on there are levels for these objects. Those of others are kept for objects of the same model that
    /// become near later, a few of each.
    ///
    /// @param objects in the order of their keys
    void follow(std::span<const NearObject> objects);

    /// Triangles of an object at a level; valid until the object's level changes or follow().
    ///
    /// @param object of follow()
    /// @param count  of a level of ObjectModel::continuous
    /// Cost: proportional to the contractions since the object's last level, or since a kept level of the model; of
    ///       an object that finds no kept one, a copy of the triangles in addition
    std::span<const TriangleMesh::Triangle> triangles(std::size_t object, std::uint32_t count);

private:
    struct Model {
        std::shared_ptr<const ProgressiveMesh> mesh;  // null: without continuous levels
        std::vector<ProgressiveMesh> kept;
    };
    struct Level {
        ObjectKey key;
        std::uint32_t model = 0;
        std::optional<ProgressiveMesh> mesh;  // none before the object is drawn
    };
    ProgressiveMesh take(std::uint32_t model, std::uint32_t count);

    std::vector<Model> models_;
    std::vector<Level> levels_, former_;  // in the order of keys
};

/// A near object of which a mesh is drawn.
struct NearDraw {
    std::size_t object = 0;      ///< among the near objects
    std::uint32_t instance = 0;  ///< in SceneDraws::instances
};

/// Continuous levels of detail of a scene's nearest objects: which they are, what they need at every threshold, and the
/// draws of a frame.
class StreamedList {
public:
    /// @param most objects with continuous levels
    explicit StreamedList(std::size_t most) : most_(most), near_(most) {}

    /// Adds the next model, whose number is how many there were before.
    void add_model(const ObjectModel& model, double fade_ratio);

    /// Whether any object may have a level of its own.
    bool is_needed() const { return is_needed_; }

    /// The frame has no objects until begin() and select().
    void clear();
    /// Begins a frame. @param log2_least of the least threshold in pixels that the frame can have
    void begin(float log2_least);
    /// Adds an object of the frame, if it may have a level of its own; in the order of keys and places.
    void add(const NearObject& object) {
        const std::optional<ContinuousModel>& model = models_[object.model];
        if (model && model->draws_mesh(object.log2_factor, log2_least_)) near_.add(object);
    }
    /// Selects the nearest of them, and adds what they need.
    void select(DemandHistogram& histogram);
    /// The nearest objects, in the order of their places.
    std::span<const NearObject> near() const { return near_.objects(); }

    /// Makes the draws of near objects at a threshold.
    ///
    /// @param models as added
    void make(std::span<const NearDraw> near, std::span<const ObjectModel> models,
              float log2_threshold);
    /// Of the last make().
    std::span<const StreamedDraw> draws() const { return draws_; }
    std::size_t triangle_count() const { return triangle_count_; }

private:
    std::size_t most_;
    bool is_needed_ = false;
    std::vector<std::optional<ContinuousModel>> models_;
    NearObjects near_;
    ContinuousLevels levels_;
    float log2_least_ = 0.0f;
    std::vector<StreamedDraw> draws_;
    std::size_t triangle_count_ = 0;
};

}  // namespace terrane::internal
