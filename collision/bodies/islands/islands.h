// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// No body, island or manifold.
inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// Connected components of the moving bodies that touch: solved together, asleep together. A body that touches no other
/// is an island of one. Islands are in order of their lowest body; bodies and links within them ascend.
class Islands {
public:
    /// @param links pairs that touch
    /// @param moves [bodies] 0: a body that connects nothing and belongs to no island
    void build(std::span<const BodyPair> links, std::span<const std::uint8_t> moves);

    std::size_t count() const { return body_starts_.size() - 1; }
    /// Indices of an island's bodies; at least one.
    std::span<const std::uint32_t> bodies(std::size_t island) const;
    /// Indices of an island's links.
    std::span<const std::uint32_t> links(std::size_t island) const;

private:
    std::uint32_t find_root(std::uint32_t body);

    std::vector<std::uint32_t> parents_;
    std::vector<std::uint32_t> islands_;  // of each body
    std::vector<std::uint32_t> bodies_, links_;
    std::vector<std::uint32_t> body_starts_{0}, link_starts_{0};
};

}  // namespace terrane::internal
