// SPDX-License-Identifier: MIT
#include "base/settings_check.h"

#include <terrane/scene/frame_governor.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

// Forgetting factor: weight of a frame relative to the next one, about ten frames of memory.
constexpr double kForgetting = 0.9;
// A frame time is a surprise, the sign of another scene, if its ratio to the prediction differs from 1 by more than
// this many standard deviations of the noise, clamped to these two ratios. Past frames then get little weight.
constexpr double kSurpriseDeviations = 3.0;
constexpr double kLeastSurprise = 1.1, kMostSurprise = 1.6;
constexpr double kSurpriseForgetting = 0.1;
// Initial relative standard deviation of frame times, and the share of the variance estimate that each frame replaces.
constexpr double kFirstDeviation = 0.03;
constexpr double kVarianceShare = 0.05;
// Share of the first frame's time assumed constant.
constexpr double kGuessedConstant = 0.2;
// Prior relative variance of a known slope.
constexpr double kSlopeVariance = 0.09;
// Share of the time limit that is left unused.
constexpr double kMargin = 0.03;
// Largest ratio of successive budgets; its third power after a frame below kFarBelow of the time limit.
constexpr double kMostGrowth = 1.15;
constexpr double kFarBelow = 0.5;
// Relative difference of triangle counts from which the times of two frames determine the slope.
constexpr double kOtherTriangles = 0.5;
// Least ratio of the slopes of successive frames.
constexpr double kLeastSlope = 0.05;

double squared(double x) { return x * x; }

}  // namespace

Result<FrameGovernor> FrameGovernor::create(const GovernorSettings& settings,
                                            std::size_t first_budget) {
    TERRANE_TRY(check_range("frame_ms", settings.frame_ms, 1e-3, 1e6));
    TERRANE_TRY(check_range("least_budget", settings.least_budget, std::size_t{1},
                            std::size_t{1'000'000'000}));
    TERRANE_TRY(check_range("most_budget", settings.most_budget, settings.least_budget,
                            std::size_t{1'000'000'000}));
    FrameGovernor governor(settings);
    governor.budget_ = std::clamp(first_budget, settings.least_budget, settings.most_budget);
    governor.variance_ = squared(kFirstDeviation);
    return governor;
}

// Fits a line to the frames by least squares. If all frames have nearly equal triangle counts, or no triangles, they do
// not determine the slope, and the known slope is kept.
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
    // Blends the measured and the known slope by their variances: the weight of the measured slope is the variance of
    // the known one divided by the sum of both.
    const double noise = variance / (kSlopeVariance * model.weight);
    const double tells = spread / (spread + noise * mean_n * mean_n + 1.0);
    const double measured = spread > 0.0 ? together / spread : known;
    const double most = mean_t / std::max(mean_n, 1.0);
    model.ms_per_triangle =
        std::min(std::max(tells * measured + (1.0 - tells) * known, kLeastSlope * known), most);
    model.constant_ms = std::max(0.0, mean_t - model.ms_per_triangle * mean_n);
}

// Adapts the model to another scene: scales the costs of past frames to that of this one, or shifts them if most of the
// time does not depend on triangles, and gives them little weight. If this frame has far more or fewer triangles than
// those before, the slope may be wrong instead: then the past costs stay, and the next fit decides.
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
        // The previous frame was an outlier if the model before it predicts this frame, and better than the model after
        // it.
        const double as_before = misfit(before_surprise_->model, frame_ms, drawn);
        if (as_before < surprising && as_before < misfit(model_, frame_ms, drawn)) {
            model_ = before_surprise_->model;
            proven_ = before_surprise_->proven;
        }
        before_surprise_.reset();
    }
    // The model cannot predict the very first frame, nor the first one with triangles, whose cost is still unknown:
    // neither is a surprise.
    const bool is_first = model_.weight == 0.0 || (model_.ms_per_triangle == 0.0 && drawn > 0.0);
    const double difference = is_first ? 0.0 : misfit(model_, frame_ms, drawn);
    const bool is_surprise = difference > surprising;
    if (is_surprise) {
        before_surprise_ = {model_, proven_};
        rescale(model_, frame_ms, drawn);
    }
    // Clipped, so that a single outlier raises the noise estimate little, while many raise it.
    if (!is_first) {
        variance_ += kVarianceShare * (squared(std::min(difference, surprising)) - variance_);
    }
    learn(model_, frame_ms, drawn, variance_);

    const double allowed = (1.0 - kMargin) * settings_.frame_ms;
    const bool is_late = frame_ms > settings_.frame_ms;
    if (!is_late) {
        proven_ = std::max(proven_, drawn);
    } else if (drawn > 0.0) {
        proven_ = std::min(proven_, drawn * allowed / frame_ms);
    }
    const double wanted = (allowed - model_.constant_ms) / std::max(model_.ms_per_triangle, 1e-12);
    // An unused budget gives no information about its cost: growth starts from the triangles drawn in time, or from the
    // budget if that was the limiting factor.
    const double from = std::max(proven_, wants_more ? static_cast<double>(budget_) : drawn);
    const double growth =
        frame_ms < kFarBelow * allowed ? kMostGrowth * kMostGrowth * kMostGrowth : kMostGrowth;
    const double most = growth * std::max(from, static_cast<double>(settings_.least_budget));
    double next = std::min(wanted, most);
    // A frame that is late by more than noise reduces the triangles at least proportionally, even if the constant part
    // alone exceeds the limit.
    if (is_late && is_surprise) next = std::min(next, drawn * allowed / frame_ms);
    budget_ = static_cast<std::size_t>(std::clamp(next, static_cast<double>(settings_.least_budget),
                                                  static_cast<double>(settings_.most_budget)));
}

}  // namespace terrane
