// SPDX-License-Identifier: MIT
#pragma once

#include "continuous/streamed_list.h"
#include "objects/frame_objects.h"
#include "objects/level_choice.h"

#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// The draws of some objects of a frame: one for each level of a model that is drawn.
class DrawList {
public:
    /// Adds the next model, whose number is how many there were before.
    void add_model(const ObjectModel& model);

    /// Chooses the levels of the objects, and appends their instances.
    ///
    /// @param models, choices [models] that were added
    /// @param near            objects whose meshes are drawn by others, in the order of their places
    void make(const FrameObjects& objects, std::span<const ObjectModel> models,
              std::span<const LevelChoice> choices, float log2_threshold,
              std::span<const NearObject> near, std::vector<ObjectInstance>& instances_out);

    /// Of the last make(). Objects that change levels have instances in two draws.
    std::span<const MeshDraw> meshes() const { return meshes_; }
    std::span<const ImpostorDraw> impostors() const { return impostors_; }
    /// Those of the near objects of which a mesh is drawn, with instances that no draw names.
    std::span<const NearDraw> near() const { return near_; }
    std::size_t object_count() const { return object_count_; }
    std::size_t triangle_count() const { return triangle_count_; }

private:
    // Instances that are drawn with one call.
    struct Bucket {
        std::uint32_t model = 0, level = 0;
        std::uint32_t count = 0, first = 0;
    };

    // A near object of which a mesh is drawn.
    struct NearPlace {
        std::size_t place = 0;  // among the objects
        float coverage = 1.0f;
    };

    void choose(const FrameObjects& objects, std::span<const ObjectModel> models,
                std::span<const LevelChoice> choices, float log2_threshold,
                std::span<const NearObject> near);
    void lay_out(std::span<const ObjectModel> models, std::vector<ObjectInstance>& instances_out);
    void fill(const FrameObjects& objects, std::span<ObjectInstance> instances);

    std::vector<std::uint32_t> first_bucket_;  // [models]
    std::vector<Bucket> buckets_;              // [levels of all models]
    std::vector<ChosenLevels> chosen_;         // [objects]
    std::vector<MeshDraw> meshes_;
    std::vector<ImpostorDraw> impostors_;
    std::vector<NearDraw> near_;
    std::vector<NearPlace> near_places_;  // [near_]
    std::size_t object_count_ = 0, triangle_count_ = 0;
};

}  // namespace terrane::internal
