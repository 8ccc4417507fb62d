// SPDX-License-Identifier: MIT
#include "source/function/checked_function.h"

#include <terrane/terrain/number_text.h>

#include <cmath>
#include <exception>
#include <limits>
#include <string>

namespace terrane::internal {
namespace {

std::string at_place(double x, double y) {
    return " at x " + number_text(x) + " m, y " + number_text(y) + " m";
}

}  // namespace

Result<double> CheckedFunction::at(double x, double y) const {
    double height = 0.0;
    try {
        height = function_(x, y);
    } catch (const std::exception& thrown) {
        return fail(ErrorCode::io, "the height function threw \"" + std::string(thrown.what()) +
                                       "\"" + at_place(x, y));
    } catch (...) {
        return fail(ErrorCode::io,
                    "the height function threw what is no std::exception" + at_place(x, y));
    }
    if (!std::isfinite(height)) {
        return fail(ErrorCode::io,
                    "the height function gave " + number_text(height) + " m" + at_place(x, y));
    }
    if (range_ && !(height >= range_->low && height <= range_->high)) {
        return fail(ErrorCode::bad_data, "the height function gave " + number_text(height) + " m" +
                                             at_place(x, y) + ", outside its range of " +
                                             number_text(range_->low) + " to " +
                                             number_text(range_->high) + " m");
    }
    return height;
}

double CheckedFunction::operator()(double x, double y) const {
    try {
        const double height = function_(x, y);
        if (std::isfinite(height)) return height;
    } catch (...) {
        // NaN stands for it
    }
    return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace terrane::internal
