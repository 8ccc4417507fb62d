// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// No body, island or touch.
inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// Bodies that touch each other, directly or through others: what has to be solved at once, and what sleeps
/// together. Islands are in order of their lowest body; bodies and links within them ascend.
class Islands {
public:
    /// @param links that touch
    /// @param moves [bodies] 0: a body that joins nothing and belongs to no island
    void build(std::span<const BodyPair> links, std::span<const std::uint8_t> moves);

    std::size_t count() const { return body_starts_.size() - 1; }
    /// Whether a body belongs to any.
    bool has(std::size_t body) const;
    /// Bodies of an island; at least one.
    std::span<const std::uint32_t> bodies(std::size_t island) const;
    /// Indices of the links of an island.
    std::span<const std::uint32_t> links(std::size_t island) const;

private:
    std::uint32_t find_root(std::uint32_t body);

    std::vector<std::uint32_t> parents_;
    std::vector<std::uint32_t> islands_;  // of each body
    std::vector<std::uint32_t> bodies_, links_;
    std::vector<std::uint32_t> body_starts_{0}, link_starts_{0};
};

}  // namespace terrane::internal
