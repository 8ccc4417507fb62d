// SPDX-License-Identifier: MIT
//
// Sources:
//   G. Steele, D. Lea, C. Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA 2014 (mix).
#include "world/body_random.h"

namespace terrane::tools {
namespace {

std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

}  // namespace

std::uint64_t hash_numbers(std::uint64_t seed, std::uint64_t index, std::uint64_t stream) {
    constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;
    return mix(mix(mix(seed + kGolden) ^ (index + kGolden)) + stream * kGolden);
}

}  // namespace terrane::tools
