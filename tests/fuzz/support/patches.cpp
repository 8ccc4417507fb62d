// SPDX-License-Identifier: MIT
#include "support/patches.h"

#include <algorithm>

namespace terrane::fuzz {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;  // repeats could double without end

using Bytes = std::vector<std::uint8_t>;
using Offset = Bytes::difference_type;

void apply(Bytes& file, Input& input) {
    const int kind = input.below(6);
    const std::size_t at = static_cast<std::size_t>(input.bits(2)) % (file.size() + 1);
    const auto place = file.begin() + static_cast<Offset>(at);
    if (kind == 5) {
        file.resize(at);
        return;
    }
    const std::size_t length = input.byte();
    const std::size_t in_file = std::min(length, file.size() - at);
    const auto end = place + static_cast<Offset>(in_file);
    if (kind == 3) {
        file.erase(place, end);
    } else if (kind == 4) {
        const Bytes range(place, end);
        file.insert(end, range.begin(), range.end());
    } else if (kind == 2) {
        const auto bytes = input.bytes(length);
        file.insert(place, bytes.begin(), bytes.end());
    } else {
        const auto bytes = input.bytes(in_file);
        std::ranges::copy(bytes, place);
    }
}

}  // namespace

std::vector<std::uint8_t> patched(std::vector<std::uint8_t> file, Input& input) {
    while (!input.is_empty() && file.size() < kMostBytes) apply(file, input);
    return file;
}

}  // namespace terrane::fuzz
