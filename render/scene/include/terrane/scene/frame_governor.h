// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstddef>
#include <optional>

namespace terrane {

/// Settings of a FrameGovernor. Fixed once it is created.
struct GovernorSettings {
    double frame_ms = 16.0;               ///< time that a frame may take, milliseconds, > 0
    std::size_t least_budget = 2'000;     ///< triangles, >= 1
    std::size_t most_budget = 1'000'000;  ///< triangles, >= least_budget
};

/// Finds the largest triangle budget that keeps frames within a time limit. Models the cost of a frame as a constant
/// plus a part proportional to its triangles, and estimates both, and the variance of frame times, from past frames. A
/// frame that is slower than the variance explains lowers the budget at once; if the next frame shows that it was an
/// outlier, the budget is restored. The budget grows in steps.
///
/// Pictures depend on timing if a governor is used: do not use it in replays.
///
/// Sources: T. Funkhouser, C. Sequin. Adaptive Display Algorithm for Interactive Frame Rates During Visualization of
///          Complex Virtual Environments. SIGGRAPH 1993 (predicting the cost of a frame).
///          K. Astrom, B. Wittenmark. Adaptive Control. 1995, section 2.2 (least squares with exponential forgetting).
class FrameGovernor {
public:
    /// Fails: invalid_argument, naming the field and its value, for settings out of range
    ///
    /// @param first_budget budget of the first frame, clamped to the range of the settings
    static Result<FrameGovernor> create(const GovernorSettings& settings, std::size_t first_budget);

    /// Largest number of triangles for the next frame.
    std::size_t budget() const { return budget_; }

    /// Updates the model with a frame. A time that is not finite or not above 0 is ignored.
    ///
    /// @param frame_ms   duration of the frame, milliseconds
    /// @param triangles  triangles that it drew
    /// @param wants_more whether a larger budget would have drawn more
    void add_frame(double frame_ms, std::size_t triangles, bool wants_more);

private:
    explicit FrameGovernor(const GovernorSettings& settings) : settings_(settings) {}

    struct CostModel {
        // Exponentially weighted sums over past frames.
        double weight = 0.0, n = 0.0, t = 0.0, nn = 0.0, nt = 0.0;
        double constant_ms = 0.0, ms_per_triangle = 0.0;

        double cost_ms(double triangles) const { return constant_ms + ms_per_triangle * triangles; }
    };
    static void learn(CostModel& model, double frame_ms, double triangles, double variance);
    static void rescale(CostModel& model, double frame_ms, double triangles);
    static double misfit(const CostModel& model, double frame_ms, double triangles);

    GovernorSettings settings_;
    std::size_t budget_ = 0;
    double proven_ = 0.0;  // most triangles drawn within the limit
    CostModel model_;
    struct Knowledge {
        CostModel model;
        double proven = 0.0;
    };
    std::optional<Knowledge> before_surprise_;  // state before the last frame, if it was a surprise
    double variance_ = 0.0;                     // of log(frame_ms / predicted ms)
};

}  // namespace terrane
