// SPDX-License-Identifier: MIT
#include "gl/square_table.h"

#include <algorithm>
#include <bit>

namespace terrane::internal {
namespace {

// The same function as in light.glsl.
std::uint32_t hash_of(const SquareTable::Entry& entry) {
    const std::uint32_t hash = static_cast<std::uint32_t>(entry.x) * 0x9e3779b1u ^
                               static_cast<std::uint32_t>(entry.y) * 0x85ebca77u ^
                               static_cast<std::uint32_t>(entry.level) * 0xc2b2ae3du;
    return hash ^ (hash >> 15);
}

std::int32_t saturate(std::int64_t value) {
    constexpr std::int64_t kMost = std::int64_t{1} << 30;
    return static_cast<std::int32_t>(std::clamp(value, -kMost, kMost));
}

}  // namespace

SquareTable::SquareTable(std::size_t count) : entries_(std::bit_ceil(2 * count + 1)) {}

void SquareTable::add(std::int64_t x, std::int64_t y, int level, std::int32_t value) {
    const Entry entry{saturate(x), saturate(y), level, value};
    const std::size_t last = entries_.size() - 1;
    std::size_t place = hash_of(entry) & last;
    while (entries_[place].level >= 0) place = (place + 1) & last;
    entries_[place] = entry;
}

}  // namespace terrane::internal
