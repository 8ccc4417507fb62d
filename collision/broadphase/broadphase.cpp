// SPDX-License-Identifier: MIT
#include "broadphase/kept_pairs.h"
#include "broadphase/row_grid.h"
#include "broadphase/sweep_and_prune.h"

#include <terrane/terrain/assert.h>

#include <cmath>

namespace terrane {
namespace {

using namespace internal;

// Compares the boxes of a method's pairs.
template <class Method>
class Boxes final : public Broadphase {
public:
    explicit Boxes(double margin) : margin_(margin), kept_(margin) {}

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere>) override {
        bounds_ = bounds;
        kept_.update(bounds);
    }
    std::span<const BodyPair> find_pairs() override {
        return kept_.find([this](std::uint32_t i, std::uint32_t j) {
            return overlap(bounds_[i], bounds_[j], margin_);
        });
    }
    std::uint64_t candidate_count() const override { return kept_.candidate_count(); }
    std::uint64_t update_operations() const override { return kept_.update_operations(); }

private:
    double margin_;
    std::span<const Aabb> bounds_;
    KeptPairs<Method> kept_;
};

// Sources:    S. Ehmann, M. Lin. SWIFT++. 2001 (cubes large enough for every rotation of what they hold).
class TwoScenes final : public Broadphase {
public:
    explicit TwoScenes(double margin) : margin_(margin), kept_(margin) {}

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere> balls) override {
        // Widened by more than the rounding of a box.
        constexpr double kRoundingMargin = 1e-11;
        bounds_ = bounds;
        cubes_.resize(balls.size());
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const BoundingSphere& ball = balls[i];
            const double half =
                ball.radius + kRoundingMargin * (ball.radius + ball.centre.cwiseAbs().sum());
            const Eigen::Vector3d around = Eigen::Vector3d::Constant(half);
            cubes_[i] = {ball.centre - around, ball.centre + around};
        }
        kept_.update(cubes_);
    }
    std::span<const BodyPair> find_pairs() override {
        return kept_.find([this](std::uint32_t i, std::uint32_t j) {
            return is_box(bounds_[i]) && is_box(bounds_[j]) &&
                   overlap(bounds_[i], bounds_[j], margin_);
        });
    }
    std::uint64_t candidate_count() const override { return kept_.candidate_count(); }
    std::uint64_t update_operations() const override {
        return kept_.update_operations() + cubes_.size();
    }

private:
    double margin_;
    std::span<const Aabb> bounds_;
    std::vector<Aabb> cubes_;  ///< of the spheres
    KeptPairs<SweepAndPrune> kept_;
};

// Every pair of boxes: the oracle.
class EveryPair final : public Broadphase {
public:
    explicit EveryPair(double margin) : margin_(margin) {}

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere>) override {
        bounds_ = bounds;
    }
    std::span<const BodyPair> find_pairs() override {
        pairs_.clear();
        candidate_count_ = 0;
        const auto count = static_cast<std::uint32_t>(bounds_.size());
        for (std::uint32_t i = 0; i < count; ++i) {
            if (!is_box(bounds_[i])) continue;
            for (std::uint32_t j = i + 1; j < count; ++j) {
                ++candidate_count_;
                if (is_box(bounds_[j]) && overlap(bounds_[i], bounds_[j], margin_)) {
                    pairs_.push_back({i, j});
                }
            }
        }
        return pairs_;
    }
    std::uint64_t candidate_count() const override { return candidate_count_; }
    std::uint64_t update_operations() const override { return 0; }

private:
    double margin_;
    std::span<const Aabb> bounds_;
    std::vector<BodyPair> pairs_;
    std::uint64_t candidate_count_ = 0;
};

}  // namespace

std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind, double margin) {
    TERRANE_ASSERT(margin >= 0.0 && std::isfinite(margin), "margin must be finite and >= 0");
    switch (kind) {
        case BroadphaseKind::sap:
            return std::make_unique<Boxes<SweepAndPrune>>(margin);
        case BroadphaseKind::grid:
            return std::make_unique<Boxes<RowGrid>>(margin);
        case BroadphaseKind::two_scene:
            return std::make_unique<TwoScenes>(margin);
        case BroadphaseKind::brute:
            break;
    }
    return std::make_unique<EveryPair>(margin);
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
