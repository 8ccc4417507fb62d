// SPDX-License-Identifier: MIT
#include "crowd/study/power_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::tools {
namespace {

// Sums of the normal equations of y = fixed + factor * u with weights 1 / y^2.
struct RelativeFit {
    double fixed = 0.0, factor = 0.0, error = std::numeric_limits<double>::infinity();
};

RelativeFit fit_line(std::span<const double> x, std::span<const double> y, double power) {
    double w1 = 0.0, wu = 0.0, wuu = 0.0, wy = 0.0, wuy = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double u = std::pow(x[i], power), weight = 1.0 / (y[i] * y[i]);
        w1 += weight;
        wu += weight * u;
        wuu += weight * u * u;
        wy += weight * y[i];
        wuy += weight * u * y[i];
    }
    RelativeFit fit;
    const double determinant = w1 * wuu - wu * wu;
    if (determinant > 1e-12 * w1 * wuu) {
        fit.fixed = (wuu * wy - wu * wuy) / determinant;
        fit.factor = (w1 * wuy - wu * wy) / determinant;
    }
    if (!(determinant > 1e-12 * w1 * wuu) || fit.fixed < 0.0) {
        fit.fixed = 0.0;
        fit.factor = wuy / wuu;
    }
    fit.error = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double relative = (fit.fixed + fit.factor * std::pow(x[i], power)) / y[i] - 1.0;
        fit.error += relative * relative;
    }
    return fit;
}

}  // namespace

std::optional<double> log_log_slope(std::span<const double> x, std::span<const double> y) {
    const auto count = static_cast<double>(x.size());
    double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double u = std::log(x[i]), v = std::log(y[i]);
        sum_x += u;
        sum_y += v;
        sum_xx += u * u;
        sum_xy += u * v;
    }
    const double spread = count * sum_xx - sum_x * sum_x;
    if (!(spread > 1e-12 * count * sum_xx)) return std::nullopt;
    return (count * sum_xy - sum_x * sum_y) / spread;
}

std::optional<PowerLaw> fit_power_law(std::span<const double> x, std::span<const double> y) {
    constexpr int kPowers = 600;
    constexpr double kMostPower = 3.0;
    if (x.size() < 4 || std::any_of(y.begin(), y.end(), [](double v) { return !(v > 0.0); })) {
        return std::nullopt;
    }
    PowerLaw law;
    double least = std::numeric_limits<double>::infinity();
    for (int step = 1; step <= kPowers; ++step) {
        const double power = kMostPower * step / kPowers;
        const RelativeFit fit = fit_line(x, y, power);
        if (fit.error >= least) continue;
        least = fit.error;
        law = {fit.fixed, fit.factor, power, fit.fixed / y.back()};
    }
    return law;
}

}  // namespace terrane::tools
