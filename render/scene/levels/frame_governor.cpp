// SPDX-License-Identifier: MIT
#include "base/settings_check.h"

#include <terrane/scene/frame_governor.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

// Weight of a frame relative to the one after it: some ten frames count.
constexpr double kForgetting = 0.9;
// A frame of more than this ratio over what was expected has met another scene: what was learnt before counts little.
constexpr double kSurprise = 1.3;
constexpr double kSurpriseForgetting = 0.1;
// Share of the first frame that is taken for constant.
constexpr double kGuessedConstant = 0.2;
// A frame below this share of the time lets the budget grow by the third power of its ratio.
constexpr double kFarBelow = 0.5;
// Least ratio of the slopes of successive frames.
constexpr double kLeastSlope = 0.05;

}  // namespace

Result<FrameGovernor> FrameGovernor::create(const GovernorSettings& settings,
                                            std::size_t first_budget) {
    if (auto ok = check_range("frame_ms", settings.frame_ms, 1e-3, 1e6); !ok)
        return tl::unexpected(ok.error());
    if (auto ok = check_range("least_budget", settings.least_budget, std::size_t{1},
                              std::size_t{1'000'000'000});
        !ok)
        return tl::unexpected(ok.error());
    if (auto ok = check_range("most_budget", settings.most_budget, settings.least_budget,
                              std::size_t{1'000'000'000});
        !ok)
        return tl::unexpected(ok.error());
    if (auto ok = check_range("most_growth", settings.most_growth, 1.01, 4.0); !ok)
        return tl::unexpected(ok.error());
    if (auto ok = check_range("margin", settings.margin, 0.0, 0.5); !ok)
        return tl::unexpected(ok.error());
    FrameGovernor governor(settings);
    governor.budget_ = std::clamp(first_budget, settings.least_budget, settings.most_budget);
    return governor;
}

// A line through the frames by least squares. Where they all have about the same triangles, or none, they do not tell
// its slope: then it is the one that was known, larger or smaller where a frame shows that triangles cost more or
// less now.
void FrameGovernor::learn(double frame_ms, double triangles) {
    const double expected = constant_ms_ + ms_per_triangle_ * triangles;
    const bool is_surprise =
        weight_ > 0.0 && (frame_ms > kSurprise * expected || frame_ms * kSurprise < expected);
    double known = ms_per_triangle_;
    if (known == 0.0) {
        known = triangles > 0.0 ? (1.0 - kGuessedConstant) * frame_ms / triangles : 0.0;
    } else if (is_surprise && known * triangles > 0.5 * expected) {
        known *= frame_ms / expected;
    }
    const double kept = is_surprise ? kSurpriseForgetting : kForgetting;
    weight_ = kept * weight_ + 1.0;
    n_ = kept * n_ + triangles;
    t_ = kept * t_ + frame_ms;
    nn_ = kept * nn_ + triangles * triangles;
    nt_ = kept * nt_ + triangles * frame_ms;
    const double mean_n = n_ / weight_, mean_t = t_ / weight_;
    const double spread = nn_ / weight_ - mean_n * mean_n;
    const double together = nt_ / weight_ - mean_n * mean_t;
    // Frames tell the slope in as far as their triangles differ.
    const double tells = spread / (spread + 1e-3 * mean_n * mean_n + 1.0);
    const double measured = spread > 0.0 ? together / spread : known;
    const double most = mean_t / std::max(mean_n, 1.0);
    ms_per_triangle_ =
        std::min(std::max(tells * measured + (1.0 - tells) * known, kLeastSlope * known), most);
    constant_ms_ = std::max(0.0, mean_t - ms_per_triangle_ * mean_n);
}

void FrameGovernor::add_frame(double frame_ms, std::size_t triangles, bool wants_more) {
    if (!(frame_ms > 0.0) || !std::isfinite(frame_ms)) return;
    const auto drawn = static_cast<double>(triangles);
    const bool is_late = frame_ms > settings_.frame_ms;
    learn(frame_ms, drawn);
    const double allowed = (1.0 - settings_.margin) * settings_.frame_ms;
    if (!is_late) {
        proven_ = std::max(proven_, drawn);
    } else if (drawn > 0.0) {
        proven_ = std::min(proven_, drawn * allowed / frame_ms);
    }
    const double wanted = (allowed - constant_ms_) / std::max(ms_per_triangle_, 1e-12);
    // A budget that is not used says nothing of its cost: growth starts from what has been drawn in time, or from the
    // budget where that kept more from being drawn.
    const double from = std::max(proven_, wants_more ? static_cast<double>(budget_) : drawn);
    const double ratio = settings_.most_growth;
    const double growth = frame_ms < kFarBelow * allowed ? ratio * ratio * ratio : ratio;
    const double most = growth * std::max(from, static_cast<double>(settings_.least_budget));
    double next = std::min(wanted, most);
    // An overlong frame reduces the triangles at least in proportion, also where the constant part alone exceeds the
    // time.
    if (is_late) next = std::min(next, drawn * allowed / frame_ms);
    budget_ = static_cast<std::size_t>(std::clamp(next, static_cast<double>(settings_.least_budget),
                                                  static_cast<double>(settings_.most_budget)));
}

}  // namespace terrane
