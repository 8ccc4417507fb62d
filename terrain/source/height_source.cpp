// SPDX-License-Identifier: MIT
#include <terrane/terrain/height_source.h>

#include <algorithm>

namespace terrane {

Result<void> HeightSource::cell_flags(const SampleGrid& /*grid*/,
                                      std::span<std::uint8_t> flags_out) const {
    std::ranges::fill(flags_out, std::uint8_t{cell_ground});
    return {};
}

}  // namespace terrane
