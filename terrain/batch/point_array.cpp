// SPDX-License-Identifier: MIT
#include <terrane/terrain/ground_batch.h>

#include <algorithm>

namespace terrane {
namespace {

// Of an array whose last point is cut short, the count includes that point, so that its lengths are refused.
PointArray interleaved(std::span<const double> numbers, std::size_t dimensions) {
    const auto from = [&](std::size_t first) {
        return numbers.subspan(std::min(first, numbers.size()));
    };
    PointArray points;
    points.count = numbers.size() / dimensions + (numbers.size() % dimensions != 0 ? 1 : 0);
    points.stride = dimensions;
    points.x = from(0);
    points.y = from(1);
    if (dimensions == 3) points.z = from(2);
    return points;
}

}  // namespace

PointArray PointArray::interleaved_xy(std::span<const double> numbers) {
    return interleaved(numbers, 2);
}

PointArray PointArray::interleaved_xyz(std::span<const double> numbers) {
    return interleaved(numbers, 3);
}

PointArray PointArray::separate(std::span<const double> x, std::span<const double> y,
                                std::span<const double> z) {
    return {.count = x.size(), .stride = 1, .x = x, .y = y, .z = z};
}

PointArray PointArray::repeated(const WorldPos& point_world, std::size_t count) {
    const std::span<const double> numbers(point_world.data(), 3);
    return {.count = count,
            .stride = 0,
            .x = numbers.subspan(0, 1),
            .y = numbers.subspan(1, 1),
            .z = numbers.subspan(2, 1)};
}

}  // namespace terrane
