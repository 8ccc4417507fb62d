// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/pair_list.h"

#include <span>
#include <vector>

namespace terrane::internal {

/// Boxes enlarged by a skin, kept while the bodies stay inside: pairs of enlarged boxes hold all pairs of boxes.
///
/// Sources:    L. Verlet. Computer "experiments" on classical fluids I. 1967 (lists of neighbours with a skin).
/// Deviations: the skin is a share of each body's own size, so that sizes may differ by any factor. A few bodies that
///             leave their boxes get new ones alone. Where all leave soon, boxes are not enlarged for a while.
class FatBoxes {
public:
    /// What the last update() did.
    enum class Change {
        none,    ///< every body is inside its enlarged box, as before
        few,     ///< those of moved() have left, and have new enlarged boxes
        all,     ///< every enlarged box is new
        without  ///< there are no enlarged boxes
    };

    /// Linear in the bodies.
    Change update(std::span<const Aabb> boxes);

    /// Enlarged boxes; an empty one where the box is empty. Of no use after Change::without.
    std::span<const Aabb> boxes() const { return fat_; }
    /// Ascending. After Change::few.
    std::span<const std::uint32_t> moved() const { return moved_; }
    /// Bodies read or written by the last update().
    std::uint64_t operations() const { return operations_; }

private:
    void find_moved(std::span<const Aabb> boxes);
    void enlarge(const Aabb& box, Aabb& fat_out) const;

    std::vector<Aabb> fat_;
    std::vector<std::uint32_t> moved_;
    std::size_t count_ = 0;  ///< of the last update
    bool is_kept_ = false;   ///< whether the enlarged boxes are those of the last update
    int age_ = 0;            ///< updates since all enlarged boxes were new
    int wait_ = 0;           ///< updates until skins are tried again
    int next_wait_ = 0;
    std::uint64_t operations_ = 0;
};

}  // namespace terrane::internal
