// SPDX-License-Identifier: MIT
#include "base/settings_check.h"

#include <terrane/scene/frame_governor.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

// Weight of a frame relative to the one after it: some ten frames count.
constexpr double kForgetting = 0.9;
// A frame whose time differs from the expected one by more than this many standard deviations of the noise, within
// these ratios, has met another scene: what was learnt before counts little.
constexpr double kSurpriseDeviations = 3.0;
constexpr double kLeastSurprise = 1.1, kMostSurprise = 1.6;
constexpr double kSurpriseForgetting = 0.1;
// Standard deviation of the first frames' times, relative, and how much of the estimate each frame replaces.
constexpr double kFirstDeviation = 0.03;
constexpr double kVarianceShare = 0.05;
// Share of the first frame that is taken for constant.
constexpr double kGuessedConstant = 0.2;
// Relative standard deviation that a known slope is taken to have, squared.
constexpr double kSlopeVariance = 0.09;
// A frame below this share of the time lets the budget grow by the third power of its ratio.
constexpr double kFarBelow = 0.5;
// From this relative difference of triangles on, the times of two frames tell the slope.
constexpr double kOtherTriangles = 0.5;
// Least ratio of the slopes of successive frames.
constexpr double kLeastSlope = 0.05;

double squared(double x) { return x * x; }

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
    governor.variance_ = squared(kFirstDeviation);
    return governor;
}

// A line through the frames by least squares. Where they all have about the same triangles, or none, they do not tell
// its slope: then it is the one that was known.
void FrameGovernor::learn(CostModel& model, double frame_ms, double triangles, double variance) {
    double known = model.ms_per_triangle;
    if (known == 0.0 && triangles > 0.0) {
        known = (1.0 - kGuessedConstant) * frame_ms / triangles;
    }
    model.weight = kForgetting * model.weight + 1.0;
    model.n = kForgetting * model.n + triangles;
    model.t = kForgetting * model.t + frame_ms;
    model.nn = kForgetting * model.nn + triangles * triangles;
    model.nt = kForgetting * model.nt + triangles * frame_ms;
    const double mean_n = model.n / model.weight, mean_t = model.t / model.weight;
    const double spread = model.nn / model.weight - mean_n * mean_n;
    const double together = model.nt / model.weight - mean_n * mean_t;
    // Frames tell the slope in as far as their triangles differ: the weight of the measured slope is the variance of
    // the known one over the sum of both.
    const double noise = variance / (kSlopeVariance * model.weight);
    const double tells = spread / (spread + noise * mean_n * mean_n + 1.0);
    const double measured = spread > 0.0 ? together / spread : known;
    const double most = mean_t / std::max(mean_n, 1.0);
    model.ms_per_triangle =
        std::min(std::max(tells * measured + (1.0 - tells) * known, kLeastSlope * known), most);
    model.constant_ms = std::max(0.0, mean_t - model.ms_per_triangle * mean_n);
}

// Adapts the model to another scene: scales the costs of the past frames to that of this one, or shifts them where most
// of the time is not that of triangles, and gives them little weight. Where this frame has far more or fewer triangles
// than those before, the slope may be wrong instead of the costs: then they stay, and the next fit decides.
void FrameGovernor::rescale(CostModel& model, double frame_ms, double triangles) {
    const double expected = model.cost_ms(triangles);
    const double mean_n = model.n / model.weight;
    const bool is_slope_in_doubt =
        std::abs(triangles - mean_n) > kOtherTriangles * std::max(triangles, mean_n);
    if (!is_slope_in_doubt && model.ms_per_triangle * triangles > 0.5 * expected) {
        const double ratio = frame_ms / expected;
        model.t *= ratio;
        model.nt *= ratio;
        model.ms_per_triangle *= ratio;
    } else if (!is_slope_in_doubt) {
        const double more = frame_ms - expected;
        model.t += more * model.weight;
        model.nt += more * model.n;
    }
    for (double* sum : {&model.weight, &model.n, &model.t, &model.nn, &model.nt}) {
        *sum *= kSurpriseForgetting;
    }
}

double FrameGovernor::misfit(const CostModel& model, double frame_ms, double triangles) {
    return std::abs(std::log(frame_ms / std::max(model.cost_ms(triangles), 1e-12)));
}

void FrameGovernor::add_frame(double frame_ms, std::size_t triangles, bool wants_more) {
    if (!(frame_ms > 0.0) || !std::isfinite(frame_ms)) return;
    const auto drawn = static_cast<double>(triangles);
    const double surprising = std::log(std::clamp(1.0 + kSurpriseDeviations * std::sqrt(variance_),
                                                  kLeastSurprise, kMostSurprise));
    if (before_surprise_) {
        // The frame before was an outlier if the model before it predicts this one, and better than the one after it.
        const double as_before = misfit(before_surprise_->model, frame_ms, drawn);
        if (as_before < surprising && as_before < misfit(model_, frame_ms, drawn)) {
            model_ = before_surprise_->model;
            proven_ = before_surprise_->proven;
        }
        before_surprise_.reset();
    }
    // Before the first frame with triangles the model does not know their cost, so that their time is no surprise.
    const bool is_first = model_.weight == 0.0 || (model_.ms_per_triangle == 0.0 && drawn > 0.0);
    const double difference = is_first ? 0.0 : misfit(model_, frame_ms, drawn);
    const bool is_surprise = difference > surprising;
    if (is_surprise) {
        before_surprise_ = {model_, proven_};
        rescale(model_, frame_ms, drawn);
    }
    // Clipped, so that one outlier does not widen what counts as noise by much, and many do.
    if (!is_first) {
        variance_ += kVarianceShare * (squared(std::min(difference, surprising)) - variance_);
    }
    learn(model_, frame_ms, drawn, variance_);

    const double allowed = (1.0 - settings_.margin) * settings_.frame_ms;
    const bool is_late = frame_ms > settings_.frame_ms;
    if (!is_late) {
        proven_ = std::max(proven_, drawn);
    } else if (drawn > 0.0) {
        proven_ = std::min(proven_, drawn * allowed / frame_ms);
    }
    const double wanted = (allowed - model_.constant_ms) / std::max(model_.ms_per_triangle, 1e-12);
    // A budget that is not used says nothing of its cost: growth starts from what has been drawn in time, or from the
    // budget where that kept more from being drawn.
    const double from = std::max(proven_, wants_more ? static_cast<double>(budget_) : drawn);
    const double ratio = settings_.most_growth;
    const double growth = frame_ms < kFarBelow * allowed ? ratio * ratio * ratio : ratio;
    const double most = growth * std::max(from, static_cast<double>(settings_.least_budget));
    double next = std::min(wanted, most);
    // A frame that is too long by more than noise reduces the triangles at least in proportion, also where the constant
    // part alone exceeds the time.
    if (is_late && is_surprise) next = std::min(next, drawn * allowed / frame_ms);
    budget_ = static_cast<std::size_t>(std::clamp(next, static_cast<double>(settings_.least_budget),
                                                  static_cast<double>(settings_.most_budget)));
}

}  // namespace terrane
