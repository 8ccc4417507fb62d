// SPDX-License-Identifier: MIT
#include "broadphase/row_grid.h"
#include "broadphase/sweep_and_prune.h"

#include <terrane/terrain/assert.h>

#include <cmath>

namespace terrane {
namespace {

using namespace internal;

// A method's candidates, filtered by the exact test that all methods share.
template <class Method>
class Filtered final : public Broadphase {
public:
    explicit Filtered(double margin) : margin_(margin), method_(margin) {}

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere>) override {
        bounds_ = bounds;
        method_.update(bounds);
    }
    std::span<const BodyPair> find_pairs() override {
        pairs_.clear();
        method_.visit_pairs([&](std::uint32_t i, std::uint32_t j) {
            if (overlap(bounds_[i], bounds_[j], margin_)) pairs_.add(i, j);
        });
        return pairs_.sort(bounds_.size());
    }
    std::uint64_t candidate_count() const override { return method_.candidate_count(); }
    std::uint64_t update_operations() const override { return method_.update_operations(); }

private:
    double margin_;
    std::span<const Aabb> bounds_;
    Method method_;
    PairList pairs_;
};

// Sources:    S. Ehmann, M. Lin. SWIFT++. 2001 (cubes large enough for every rotation of what they hold).
class TwoScenes final : public Broadphase {
public:
    explicit TwoScenes(double margin) : margin_(margin), cubes_(margin) {}

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere> balls) override {
        // Widened by more than the rounding of a box.
        constexpr double kRoundingMargin = 1e-11;
        bounds_ = bounds;
        boxes_.resize(balls.size());
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const BoundingSphere& ball = balls[i];
            const double half =
                ball.radius + kRoundingMargin * (ball.radius + ball.centre.cwiseAbs().sum());
            const Eigen::Vector3d around = Eigen::Vector3d::Constant(half);
            boxes_[i] = {ball.centre - around, ball.centre + around};
        }
        cubes_.update(boxes_);
    }
    std::span<const BodyPair> find_pairs() override {
        pairs_.clear();
        candidate_count_ = 0;
        cubes_.visit_pairs([&](std::uint32_t i, std::uint32_t j) {
            ++candidate_count_;
            if (is_box(bounds_[i]) && is_box(bounds_[j]) &&
                overlap(bounds_[i], bounds_[j], margin_)) {
                pairs_.add(i, j);
            }
        });
        return pairs_.sort(bounds_.size());
    }
    std::uint64_t candidate_count() const override { return candidate_count_; }
    std::uint64_t update_operations() const override {
        return cubes_.update_operations() + boxes_.size();
    }

private:
    double margin_;
    std::span<const Aabb> bounds_;
    std::vector<Aabb> boxes_;  ///< cubes of the spheres
    SweepAndPrune cubes_;
    PairList pairs_;
    std::uint64_t candidate_count_ = 0;
};

// Every pair of boxes: the oracle.
class AllPairs {
public:
    explicit AllPairs(double) {}

    void update(std::span<const Aabb> boxes) { boxes_ = boxes; }
    template <class Take>
    void visit_pairs(Take&& take) {
        candidate_count_ = 0;
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            if (!is_box(boxes_[i])) continue;
            for (std::size_t j = i + 1; j < boxes_.size(); ++j) {
                ++candidate_count_;
                if (is_box(boxes_[j])) {
                    take(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
                }
            }
        }
    }
    std::uint64_t candidate_count() const { return candidate_count_; }
    std::uint64_t update_operations() const { return 0; }

private:
    std::span<const Aabb> boxes_;
    std::uint64_t candidate_count_ = 0;
};

}  // namespace

std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind, double margin) {
    TERRANE_ASSERT(margin >= 0.0 && std::isfinite(margin), "margin must be finite and >= 0");
    switch (kind) {
        case BroadphaseKind::sap:
            return std::make_unique<Filtered<SweepAndPrune>>(margin);
        case BroadphaseKind::grid:
            return std::make_unique<Filtered<RowGrid>>(margin);
        case BroadphaseKind::two_scene:
            return std::make_unique<TwoScenes>(margin);
        case BroadphaseKind::brute:
            break;
    }
    return std::make_unique<Filtered<AllPairs>>(margin);
}

std::string_view to_string(BroadphaseKind kind) {
    switch (kind) {
        case BroadphaseKind::sap:
            return "sap";
        case BroadphaseKind::grid:
            return "grid";
        case BroadphaseKind::two_scene:
            return "two-scene";
        case BroadphaseKind::brute:
            break;
    }
    return "brute";
}

}  // namespace terrane
