// SPDX-License-Identifier: MIT
// The C++ side of benchmark.py: heights of the points of a file, in a loop that writes the arrays that Python gets.
//
//   python_heights_benchmark POINTS ROUNDS     POINTS: doubles, all x, then all y. Prints each round's milliseconds
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <vector>

namespace {

using namespace terrane;

struct Columns {
    explicit Columns(std::size_t count)
        : height(count), normal(3 * count), error_m(count), filled(count), status(count) {}
    std::vector<double> height, normal, error_m;
    std::vector<std::uint8_t> filled;
    std::vector<std::int8_t> status;
};

void ask(const Ground& ground, const std::vector<double>& numbers, Columns& out) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const std::size_t count = numbers.size() / 2;
    for (std::size_t i = 0; i < count; ++i) {
        const HeightAnswer answer = ground.height(numbers[i], numbers[count + i]);
        const bool is_ok = answer.status == QueryStatus::ok;
        out.height[i] = is_ok ? answer.height : kNaN;
        for (Eigen::Index axis = 0; axis < 3; ++axis)
            out.normal[3 * i + static_cast<std::size_t>(axis)] = is_ok ? answer.normal[axis] : kNaN;
        out.error_m[i] = is_ok ? answer.error_m : kNaN;
        out.filled[i] = is_ok && answer.filled;
        out.status[i] = static_cast<std::int8_t>(answer.status);
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    std::ifstream file(argv[1], std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    std::vector<double> numbers(bytes.size() / sizeof(double));
    std::copy_n(bytes.begin(), numbers.size() * sizeof(double),
                reinterpret_cast<char*>(numbers.data()));
    // As grounds.small_fractal() has it.
    const auto source = FractalHeights::create({.seed = 7,
                                                .octave_count = 8,
                                                .amplitude = 60.0,
                                                .wavelength_log2 = 9,
                                                .root_size_log2 = 10})
                            .value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    const RequiredRegion region = terrain.require({-100, -100, 100, 100}, 0.0);
    const Ground ground = terrain.load({}, {}, 0.0).ground;
    Columns out(numbers.size() / 2);
    ask(ground, numbers, out);
    double sum = 0.0;
    for (int round = 0; round < std::atoi(argv[2]); ++round) {
        const auto begin = std::chrono::steady_clock::now();
        ask(ground, numbers, out);
        const std::chrono::duration<double, std::milli> spent =
            std::chrono::steady_clock::now() - begin;
        std::printf("%.4f\n", spent.count());
        sum += out.height[0];
    }
    return std::isfinite(sum) ? 0 : 1;
}
