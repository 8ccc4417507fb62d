// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/tile_level_set.h"

#include <openvdb/tree/InternalNode.h>
#include <openvdb/tree/LeafNode.h>
#include <openvdb/tree/RootNode.h>
#include <openvdb/tree/Tree.h>

namespace terrane::internal {

inline constexpr int kLeafSide = 4, kLeafNodes = 64;
using NodeLeaf = openvdb::tree::LeafNode<std::int16_t, 2>;
using NodeTree =
    openvdb::tree::Tree<openvdb::tree::RootNode<openvdb::tree::InternalNode<NodeLeaf, 2>>>;

struct TileLevelSet::Trees {
    NodeTree to_void, to_solid;
    Trees() : to_void(kBandSteps), to_solid(kBandSteps) {}
    NodeTree& of(Field field) { return field == Field::to_void ? to_void : to_solid; }
};

}  // namespace terrane::internal
