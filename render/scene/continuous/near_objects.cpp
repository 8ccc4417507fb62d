// SPDX-License-Identifier: MIT
#include "continuous/near_objects.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// log2(9 / 8): so much nearer must an object be that takes the place of another one.
constexpr float kNearer = 0.169925f;

}  // namespace

void NearObjects::select() {
    if (objects_.size() > most_) {
        ranked_.clear();
        auto was_near = were_near_.begin();
        for (std::size_t i = 0; i < objects_.size(); ++i) {
            // both are in the order of keys
            while (was_near != were_near_.end() && *was_near < objects_[i].key) ++was_near;
            const bool stays = was_near != were_near_.end() && *was_near == objects_[i].key;
            ranked_.push_back({objects_[i].log2_factor + (stays ? kNearer : 0.0f),
                               static_cast<std::uint32_t>(i)});
        }
        const auto most = static_cast<std::ptrdiff_t>(most_);
        std::nth_element(ranked_.begin(), ranked_.begin() + most, ranked_.end(),
                         [](const Ranked& a, const Ranked& b) {
                             return a.nearness != b.nearness ? a.nearness > b.nearness
                                                             : a.candidate < b.candidate;
                         });
        ranked_.resize(most_);
        std::sort(ranked_.begin(), ranked_.end(),
                  [](const Ranked& a, const Ranked& b) { return a.candidate < b.candidate; });
        // candidates only move down
        for (std::size_t i = 0; i < most_; ++i) objects_[i] = objects_[ranked_[i].candidate];
        objects_.resize(most_);
    }
    were_near_.clear();
    for (const NearObject& object : objects_) were_near_.push_back(object.key);
}

}  // namespace terrane::internal
