// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/tile_level_set.h"

#include <openvdb/tree/InternalNode.h>
#include <openvdb/tree/LeafNode.h>
#include <openvdb/tree/RootNode.h>
#include <openvdb/tree/Tree.h>
#include <tbb/task_arena.h>

namespace terrane::internal {

inline constexpr int kLeafSide = 4, kLeafNodes = 64;
using NodeLeaf = openvdb::tree::LeafNode<std::int16_t, 2>;
using NodeTree =
    openvdb::tree::Tree<openvdb::tree::RootNode<openvdb::tree::InternalNode<NodeLeaf, 2>>>;

/// Does something that OpenVDB divides among threads, such as to copy or free a tree, on this thread alone: tiles are
/// divided among threads already, and a frame's thread is not to wait for others.
template <class Work>
auto alone(const Work& work) {
    return tbb::task_arena(1).execute(work);
}

struct TileLevelSet::Trees {
    NodeTree to_void, to_solid;
    Trees() : to_void(kBandSteps), to_solid(kBandSteps) {}
    Trees(const Trees& other) = default;
    Trees& operator=(const Trees&) = delete;
    ~Trees() {
        alone([this] {
            to_void.clear();
            to_solid.clear();
        });
    }
    NodeTree& of(Field field) { return field == Field::to_void ? to_void : to_solid; }
};

}  // namespace terrane::internal
