// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/function_heights.h>

namespace terrane::internal {

/// A caller's function that answers with a Result: it may throw, or give what is no height.
class CheckedFunction {
public:
    /// @param range heights outside it are refused; absent: any finite height is accepted
    CheckedFunction(HeightFunction function, const std::optional<HeightInterval>& range)
        : function_(std::move(function)), range_(range) {}

    /// The height, metres.
    /// Fails: io if the function throws or gives NaN or infinity; bad_data outside the range
    Result<double> at(double x, double y) const;
    /// The same; NaN instead of an error.
    double operator()(double x, double y) const;

private:
    HeightFunction function_;
    std::optional<HeightInterval> range_;
};

}  // namespace terrane::internal
