// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

namespace terrane::internal {

/// Packs the samples of a raster into 32 bits each: base + step * number, the number a float or an integer. Unpacked
/// heights are relative to the base, so that sums and differences lose no digits where heights are far from 0.
class SamplePacking {
public:
    /// For bands whose numbers floats hold exactly: no sample is rounded.
    ///
    /// @param scale, offset  of the band, metres; neither need be finite
    static SamplePacking of_floats(double scale, double offset);
    /// Integer multiples of the finest power of two that covers `low` to `high`, metres.
    static SamplePacking of_range(double low, double high);

    /// Metres; unpacked heights are relative to it.
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
