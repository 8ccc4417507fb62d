// SPDX-License-Identifier: MIT
#include "dem_detail.h"
#include "dem_source.h"

#include <terrane/dem/dem_heights.h>

#include <cmath>

namespace terrane {

Result<std::shared_ptr<const HeightSource>> DemHeights::open(const std::string& path,
                                                             const DemSettings& settings,
                                                             DemInfo* info_out) {
    if (auto checked = internal::check_detail(settings); !checked) {
        return tl::unexpected(checked.error());
    }
    auto source = internal::DemSource::create(path, settings.finest_spacing, {});
    if (!source) return tl::unexpected(source.error());
    if (info_out != nullptr) *info_out = (*source)->info();
    if (!settings.detail_seed) return *source;
    return internal::add_dem_detail(*source, settings);
}

}  // namespace terrane
