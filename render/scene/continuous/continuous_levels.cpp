// SPDX-License-Identifier: MIT
#include "continuous/continuous_levels.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

// Levels of a model that are kept for objects to come. One has 12 bytes a triangle of the finest level.
constexpr std::size_t kMostKept = 4;

}  // namespace

void ContinuousLevels::follow(std::span<const NearObject> objects) {
    std::swap(levels_, former_);
    levels_.clear();
    const auto leave = [&](Level& level) {
        std::vector<ProgressiveMesh>& kept = models_[level.model].kept;
        if (level.mesh && kept.size() < kMostKept) kept.push_back(*std::move(level.mesh));
    };
    auto former = former_.begin();
    for (const NearObject& object : objects) {
        for (; former != former_.end() && former->key < object.key; ++former) leave(*former);
        if (former != former_.end() && former->key == object.key) {
            levels_.push_back(std::move(*former++));
        } else {
            levels_.push_back({object.key, object.model, std::nullopt});
        }
    }
    for (; former != former_.end(); ++former) leave(*former);
    former_.clear();
}

// The kept level with the fewest contractions to go.
ProgressiveMesh ContinuousLevels::take(std::uint32_t model, std::uint32_t count) {
    std::vector<ProgressiveMesh>& kept = models_[model].kept;
    if (kept.empty()) return models_[model].mesh->share();
    const auto distance = [&](const ProgressiveMesh& mesh) {
        const std::size_t has = mesh.triangles().size();
        return has > count ? has - count : count - has;
    };
    const auto nearest = std::min_element(kept.begin(), kept.end(),
                                          [&](const ProgressiveMesh& a, const ProgressiveMesh& b) {
                                              return distance(a) < distance(b);
                                          });
    ProgressiveMesh mesh = std::move(*nearest);
    kept.erase(nearest);
    return mesh;
}

std::span<const TriangleMesh::Triangle> ContinuousLevels::triangles(std::size_t object,
                                                                    std::uint32_t count) {
    Level& level = levels_[object];
    if (!level.mesh) level.mesh = take(level.model, count);
    level.mesh->set_triangle_count(count);
    return level.mesh->triangles();
}

}  // namespace terrane::internal
