// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace terrane::test {

/// FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo) of the bytes of plain values.
class Hash {
public:
    template <class T>
    void add(const T& value) {
        const auto* bytes = reinterpret_cast<const unsigned char*>(&value);
        for (std::size_t i = 0; i < sizeof(T); ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
    }
    template <class T>
    void add_all(std::span<const T> values) {
        for (const T& value : values) add(value);
    }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace terrane::test
