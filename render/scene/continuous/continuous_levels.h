// SPDX-License-Identifier: MIT
#pragma once

#include "continuous/near_objects.h"

#include <terrane/scene/object_model.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

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

}  // namespace terrane::internal
