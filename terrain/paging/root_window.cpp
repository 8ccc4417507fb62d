// SPDX-License-Identifier: MIT
//
// The root window of a world with more root squares than memory holds. It moves when the client leaves its middle and
// all root squares of the new window are loaded, so that frames never lack a root square. When the client has left the
// window itself, as after a jump, the window moves at once.
#include "chunks/root_window.h"

#include "paging/pager_state.h"

namespace terrane {

using internal::ChunkTree;

// The position that the window follows; none without clients.
std::optional<WorldVec2> Pager::State::window_place() const {
    if (!predicted_views.empty()) return predicted_views.front().states.front().eye_world.head<2>();
    if (!bodies.empty()) return bodies.front().centre_world.head<2>();
    if (tickets.empty()) return std::nullopt;
    const WorldRect& region = tickets.begin()->second.region;
    return WorldVec2(0.5 * (region.west + region.east), 0.5 * (region.south + region.north));
}

// Returns whether the window has moved.
bool Pager::State::move_window() {
    const Lattice& world = source->lattice();
    if (world.root_window == 0) return false;
    const std::optional<WorldVec2> place = window_place();
    if (!place) return false;
    next_window = internal::moved_root_window(world, tree.window(), *place);
    std::erase_if(next_roots,
                  [this](const auto& root) { return !next_window.contains(root.first); });
    if (next_window == tree.window()) return false;
    const bool is_inside = internal::rect_of_roots(tree.window()).contains(place->x(), place->y());
    if (is_inside && !absent_next_roots().empty()) return false;
    for (const ChunkKey& key : tree.roots()) {
        const ChunkTree::Index index = tree.find(key);
        if (index != ChunkTree::kNone && !next_window.contains(key)) budget.evict_tree(index);
    }
    tree.set_window(next_window);
    for (auto& [key, root] : next_roots) insert(std::move(root.chunk), root.bytes_read);
    next_roots.clear();
    return true;
}

// Root squares of the next window that are not loaded.
std::vector<ChunkKey> Pager::State::absent_next_roots() const {
    std::vector<ChunkKey> absent;
    for (std::int32_t y = 0; y < next_window.root_count_y; ++y) {
        for (std::int32_t x = 0; x < next_window.root_count_x; ++x) {
            const ChunkKey key{next_window.first_root_x + x, next_window.first_root_y + y, 0};
            if (tree.find(key) == ChunkTree::kNone && !next_roots.contains(key))
                absent.push_back(key);
        }
    }
    return absent;
}

}  // namespace terrane
