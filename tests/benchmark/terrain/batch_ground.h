// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/ground.h>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace terrane::bench {

template <class T>
T value_or_exit(Result<T> result) {
    if (result) return std::move(*result);
    std::fprintf(stderr, "batch_benchmark: %s\n", result.error().message.c_str());
    std::exit(1);
}

/// Fractal ground of 2 km x 2 km around (0, 0), 1 m between samples, all of it resident: 256 chunks of 0.13 MB.
const Ground& fractal_ground();

/// The counter `per_item`: seconds of the clock that the benchmark uses, for one of `count` items of an iteration.
void set_item_time(benchmark::State& state, std::size_t count);

}  // namespace terrane::bench
