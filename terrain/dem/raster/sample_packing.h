// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

namespace terrane::internal {

/// How the samples of a raster are held in 32 bits each: base + step * number, the number a float or
/// an integer. What is read out is relative to the base, so that sums and differences lose no digits
/// where heights lie far from 0.
class SamplePacking {
public:
    /// Numbers of a band that a float holds exactly: no sample is rounded.
    ///
    /// @param scale, offset  of the band, metres; neither need be finite
    static SamplePacking of_floats(double scale, double offset);
    /// Integer multiples of a power of two, the finest that reaches from `low` to `high`, metres.
    static SamplePacking of_range(double low, double high);

    /// Metres; what is read out is relative to it.
    double base() const { return base_; }

    /// @param height  metres, not relative to the base; NaN: no data
    std::uint32_t pack(double height) const { return pack_relative(height - base_); }
    std::uint32_t pack_relative(double height) const;
    /// Metres from the base; NaN: no data.
    double unpack(std::uint32_t packed) const;
    void unpack(std::span<const std::uint32_t> packed, double* heights_out) const;

private:
    SamplePacking() = default;

    double base_ = 0.0;
    double step_ = 1.0;
    bool is_integer_ = false;
};

}  // namespace terrane::internal
