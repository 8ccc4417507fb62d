// SPDX-License-Identifier: MIT
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
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

}  // namespace terrane::internal
