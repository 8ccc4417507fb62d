// SPDX-License-Identifier: MIT
#include "raster/sample_packing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrane::internal {
namespace {

constexpr std::int32_t kNoData = std::numeric_limits<std::int32_t>::min();
constexpr double kMostNumber = 0x1p31 - 1.0;
/// Finest step: far below every quantum.
constexpr int kFinestStepLog2 = -50;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double unpack_integer(std::uint32_t packed, double step) {
    const auto number = static_cast<std::int32_t>(packed);
    return number == kNoData ? kNaN : step * static_cast<double>(number);
}

double unpack_float(std::uint32_t packed, double step) {
    return step * static_cast<double>(std::bit_cast<float>(packed));
}

}  // namespace

SamplePacking SamplePacking::of_floats(double scale, double offset) {
    SamplePacking packing;
    if (std::isfinite(scale) && scale != 0.0) packing.step_ = scale;
    if (std::isfinite(offset)) packing.base_ = offset;
    return packing;
}

SamplePacking SamplePacking::of_range(double low, double high) {
    SamplePacking packing;
    packing.is_integer_ = true;
    const double range = high - low;
    // Near 0 a base gains nothing, and whole numbers stay exact.
    const bool is_far = std::max(std::fabs(low), std::fabs(high)) > 2.0 * range;
    if (is_far) packing.base_ = low + 0.5 * range;
    const double reach = std::max(high - packing.base_, packing.base_ - low);
    packing.step_ = std::ldexp(1.0, kFinestStepLog2);
    while (reach > (kMostNumber - 1.0) * packing.step_) packing.step_ *= 2.0;
    // A multiple of the step, so a whole number if the step is one.
    if (is_far) packing.base_ = std::floor(packing.base_ / packing.step_) * packing.step_;
    return packing;
}

std::uint32_t SamplePacking::pack_relative(double height) const {
    const double number = height / step_;
    if (!is_integer_) return std::bit_cast<std::uint32_t>(static_cast<float>(number));
    if (std::isnan(number)) return static_cast<std::uint32_t>(kNoData);
    const double nearest = std::clamp(std::floor(number + 0.5), -kMostNumber, kMostNumber);
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(nearest));
}

double SamplePacking::unpack(std::uint32_t packed) const {
    return is_integer_ ? unpack_integer(packed, step_) : unpack_float(packed, step_);
}

void SamplePacking::unpack(std::span<const std::uint32_t> packed, double* heights_out) const {
    const double step = step_;
    if (is_integer_) {
        for (std::size_t i = 0; i < packed.size(); ++i) {
            heights_out[i] = unpack_integer(packed[i], step);
        }
    } else {
        for (std::size_t i = 0; i < packed.size(); ++i) {
            heights_out[i] = unpack_float(packed[i], step);
        }
    }
}

}  // namespace terrane::internal
