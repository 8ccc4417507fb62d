// SPDX-License-Identifier: MIT
#include "benchmark/batch/batch_ground.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <memory>

namespace terrane::bench {

const Ground& fractal_ground() {
    static const Ground ground = [] {
        FractalSettings settings;
        settings.seed = 3;
        settings.root_size_log2 = 10;
        settings.finest_spacing_log2 = 0;
        settings.wavelength_log2 = 10;
        settings.amplitude = 100.0;
        const std::shared_ptr<const HeightSource> source =
            value_or_exit(FractalHeights::create(settings));
        PagerSettings paging;
        paging.memory_bytes = std::size_t{1} << 30;
        paging.contact_spacing = 1.0;
        paging.worker_count = 0;
        Pager pager = value_or_exit(Pager::create(source, paging));
        const Pager::Ticket ticket = pager.require(source->extent(), 0.0);
        pager.update({}, {}, 0.0);
        pager.finish();
        if (!pager.is_ready(ticket)) {
            std::fprintf(stderr, "batch_benchmark: the ground is not resident\n");
            std::exit(1);
        }
        return Ground(pager.resident(), pager.contact_level());
    }();
    return ground;
}

void set_item_time(benchmark::State& state, std::size_t count) {
    const double items = static_cast<double>(state.iterations()) * static_cast<double>(count);
    state.counters["per_item"] =
        benchmark::Counter(items, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

}  // namespace terrane::bench
