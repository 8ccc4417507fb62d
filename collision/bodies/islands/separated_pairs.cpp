// SPDX-License-Identifier: MIT
#include "bodies/islands/separated_pairs.h"

#include <algorithm>
#include <iterator>

namespace terrane::internal {
namespace {

bool is_earlier_pair(const BodyPair& a, const BodyPair& b) {
    return a.a != b.a ? a.a < b.a : a.b < b.b;
}

}  // namespace

void SeparatedPairs::begin(std::span<const RigidBody> bodies) {
    const std::size_t known = std::min(poses_.size(), bodies.size());
    travel_.resize(bodies.size(), 0.0);
    poses_.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const Pose& pose = bodies[i].pose;
        const bool is_unmoved =
            poses_[i].translation == pose.translation && poses_[i].rotation == pose.rotation;
        if (i >= known || is_unmoved) {
            poses_[i] = pose;
            continue;
        }
        travel_[i] += greatest_move(bodies[i], poses_[i], pose);
        poses_[i] = pose;
    }
    next_ = 0;
    kept_.clear();
    added_.clear();
}

bool SeparatedPairs::is_clear(const BodyPair& pair, double reach) {
    while (next_ < entries_.size() && is_earlier_pair(entries_[next_].pair, pair)) ++next_;
    if (next_ == entries_.size() || !(entries_[next_].pair == pair)) return false;
    if (!(entries_[next_].travel - travel_of(pair) > reach)) return false;
    kept_.push_back(entries_[next_]);
    return true;
}

void SeparatedPairs::add(const BodyPair& pair, double distance) {
    if (distance > 0.0) added_.push_back({pair, travel_of(pair) + distance});
}

void SeparatedPairs::end() {
    entries_.clear();
    std::merge(kept_.begin(), kept_.end(), added_.begin(), added_.end(),
               std::back_inserter(entries_),
               [](const Entry& a, const Entry& b) { return is_earlier_pair(a.pair, b.pair); });
}

}  // namespace terrane::internal
