// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>

namespace terrane::tools {

/// Least-squares slope of log y over log x; absent for fewer than two different x.
std::optional<double> log_log_slope(std::span<const double> x, std::span<const double> y);

/// y = fixed + factor * x^power.
struct PowerLaw {
    double fixed = 0.0;  ///< >= 0: what does not depend on x
    double factor = 0.0;
    double power = 0.0;
    double fixed_share = 0.0;  ///< of the last y

    /// The power means little then: what it describes is a small part of every y.
    bool is_mostly_fixed() const { return fixed_share > 0.8; }
};

/// The power law with the least sum of squared relative errors; powers up to 3 in steps of 0.005 are tried. Absent for
/// fewer than four points, or where a y is not above 0.
std::optional<PowerLaw> fit_power_law(std::span<const double> x, std::span<const double> y);

}  // namespace terrane::tools
