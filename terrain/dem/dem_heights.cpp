// SPDX-License-Identifier: MIT
#include "dem_detail.h"
#include "dem_source.h"

#include <terrane/dem/dem_heights.h>

#include <cmath>
#include <cstdio>
#include <new>

namespace terrane {
namespace {

Result<void> check(const DemSettings& settings) {
    if (!(settings.read_timeout > 0.0)) {
        char text[80];
        std::snprintf(text, sizeof text, "read_timeout must be above 0 s, got %g",
                      settings.read_timeout);
        return fail(ErrorCode::invalid_argument, text);
    }
    if (!(settings.spacing_tolerance >= 1.0 && settings.spacing_tolerance <= 2.0)) {
        char text[80];
        std::snprintf(text, sizeof text, "spacing_tolerance must be 1 to 2, got %g",
                      settings.spacing_tolerance);
        return fail(ErrorCode::invalid_argument, text);
    }
    return internal::check_detail(settings);
}

Result<std::shared_ptr<const HeightSource>> open_source(const std::string& path,
                                                        const DemSettings& settings,
                                                        DemInfo* info_out) {
    internal::StoreSettings store;
    store.limit_bytes = settings.memory_bytes;
    store.patience_s = settings.read_timeout;
    store.bounds_cache = settings.cache;
    auto source = internal::DemSource::create(path, settings.finest_spacing, store,
                                              settings.progress, settings.spacing_tolerance);
    if (!source) return tl::unexpected(source.error());
    if (info_out != nullptr) {
        *info_out = (*source)->info();
        info_out->from_cache = (*source)->cache_use().is_hit;
        info_out->cache_note = (*source)->cache_use().note;
    }
    if (!settings.detail_seed) return *source;
    return internal::add_dem_detail(*source, settings);
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> DemHeights::open(const std::string& path,
                                                             const DemSettings& settings,
                                                             DemInfo* info_out) {
    if (auto checked = check(settings); !checked) return tl::unexpected(checked.error());
    try {
        return open_source(path, settings, info_out);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory,
                    "out of memory while opening raster \"" + path + "\"");
    }
}

}  // namespace terrane
