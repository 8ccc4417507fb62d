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

/// Identifies an object of a scene during the lifetime of its group.
struct ObjectKey {
    std::uint64_t cluster_order = 0;  ///< ObjectCluster::order, never reused
    std::uint32_t index = 0;          ///< in the cluster
    auto operator<=>(const ObjectKey&) const = default;
};

/// An object of a frame that is a candidate for a continuous level.
struct NearObject {
    ObjectKey key;
    std::uint32_t model = 0;
    std::size_t place = 0;     ///< index among all objects of the frame
    float log2_factor = 0.0f;  ///< log2 of pixels per metre of error at scale 1
};

/// Selects the nearest objects in view: those with the most pixels per metre of their models. A selected object stays
/// until another one has an eighth more pixels per metre, so that equally near objects do not alternate.
class NearObjects {
public:
    /// @param most objects, above 0
    explicit NearObjects(std::size_t most) : most_(most) {}

    /// Begins a frame without candidates.
    void clear() { objects_.clear(); }
    /// Adds a candidate. Keys and places must increase from candidate to candidate.
    void add(const NearObject& object) { objects_.push_back(object); }
    /// Keeps the nearest candidates, in the same order. Keys break ties.
    ///
    /// Cost: O(candidates)
    void select();

    /// The candidates; after select() only the nearest of them.
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

/// The triangles of near objects: each object has its own level, which persists between frames and is changed by the
/// contractions between two levels.
class ContinuousLevels {
public:
    /// Adds a model; models are numbered in the order in which they are added.
    void add_model(const ObjectModel& model) { models_.push_back({model.continuous, {}}); }

    /// Sets the objects that have levels. A few levels of former objects are kept per model, for objects of that model
    /// that become near later.
    ///
    /// @param objects in the order of their keys
    void follow(std::span<const NearObject> objects);

    /// Triangles of an object at a level; valid until the next call for this object, or of follow().
    ///
    /// @param object index among the objects of follow()
    /// @param count  number of triangles of a level of ObjectModel::continuous
    /// Cost: proportional to the contractions since the object's last level, or since a kept level of the model; an
    ///       object without a kept level also copies the triangles
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

/// A near object that is drawn as a mesh.
struct NearDraw {
    std::size_t object = 0;      ///< among the near objects
    std::uint32_t instance = 0;  ///< in SceneDraws::instances
};

/// Continuous levels of detail of a scene's nearest objects: their selection, their triangle demands, and the draws of
/// a frame.
class StreamedList {
public:
    /// @param most objects with continuous levels
    explicit StreamedList(std::size_t most) : most_(most), near_(most) {}

    /// Adds a model; models are numbered in the order in which they are added.
    void add_model(const ObjectModel& model, double fade_ratio);

    /// Whether any object may have a continuous level.
    bool is_needed() const { return is_needed_; }

    /// Removes the frame's objects; there are none until begin() and select().
    void clear();
    /// Begins a frame. @param log2_least log2 of the frame's least threshold in pixels
    void begin(float log2_least);
    /// Adds an object of the frame if it may have a continuous level. Keys and places must increase.
    void add(const NearObject& object) {
        const std::optional<ContinuousModel>& model = models_[object.model];
        if (model && model->draws_mesh(object.log2_factor, log2_least_)) near_.add(object);
    }
    /// Selects the nearest objects, and adds their triangle demands.
    void select(DemandHistogram& histogram);
    /// The nearest objects, in the order of their places.
    std::span<const NearObject> near() const { return near_.objects(); }

    /// Creates the draws of near objects at a threshold.
    ///
    /// @param models as added
    void make(std::span<const NearDraw> near, std::span<const ObjectModel> models,
              float log2_threshold);
    /// Draws of the last make().
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
