// SPDX-License-Identifier: MIT
// Ground from a function: with a bound of its slope everything is certified, without one nothing is.
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/function_heights.h>
#include <terrane/terrain/terrain.h>

#include <cmath>
#include <cstdio>

using namespace terrane;

namespace {

// A volcano: 600 m high, nowhere steeper than 1 in 5.
double volcano(double x, double y) {
    const double distance = std::sqrt(x * x + y * y);
    return std::abs(600.0 - 0.2 * distance);
}

void print_height(std::shared_ptr<const HeightSource> source, double x, double y) {
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    const RequiredRegion region = terrain.require({x - 10.0, y - 10.0, x + 10.0, y + 10.0}, 0.0);
    const HeightAnswer answer = terrain.load({}, {}, 0.0).ground.height(x, y);
    std::printf("%.2f m, within %.2f m\n", answer.height, answer.error_m);
}

}  // namespace

int main() {
    const WorldRect extent{-8000.0, -8000.0, 8000.0, 8000.0};
    const auto known = heights_from_function(volcano, {.extent = extent, .slope = 0.2}).value();
    const auto unknown = heights_from_function(volcano, {.extent = extent}).value();
    print_height(known, 1200.0, 350.0);
    print_height(unknown, 1200.0, 350.0);

    // An airfield on the volcano's slope: 900 m x 60 m, level, with banks of 40 m around it.
    const FlatArea field{
        .polygon = polygon_of({800.0, 320.0, 1700.0, 380.0}), .feather = 40.0, .height = 340.0};
    const auto with_field = flatten_heights(known, {&field, 1}).value();
    print_height(with_field, 1200.0, 350.0);
    return known->is_certified() && !unknown->is_certified() && with_field->is_certified() ? 0 : 1;
}
