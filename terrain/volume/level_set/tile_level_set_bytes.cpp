// SPDX-License-Identifier: MIT
// Level sets as bytes.
#include "level_set/node_tree.h"
#include "level_set/sampled_grid.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include <exception>
#include <sstream>

namespace terrane::internal {

TileLevelSet::TileLevelSet(const TileLevelSet& other)
    : trees_(alone([&] { return std::make_unique<Trees>(*other.trees_); })), band_(other.band_) {}

std::vector<std::uint8_t> TileLevelSet::encoded() const {
    std::ostringstream out(std::ios::binary);
    openvdb::io::setDataCompression(out, openvdb::io::COMPRESS_NONE);
    for (const NodeTree* tree : {&trees_->to_void, &trees_->to_solid}) {
        tree->writeTopology(out);
        tree->writeBuffers(out);
    }
    const std::string bytes = std::move(out).str();
    return {bytes.begin(), bytes.end()};
}

Result<void> TileLevelSet::decode(std::span<const std::uint8_t> bytes) {
    const auto damaged = [] {
        return fail(ErrorCode::bad_data, "the level sets of a tile are damaged");
    };
    try {
        initialize_openvdb();
        std::istringstream in(std::string(bytes.begin(), bytes.end()), std::ios::binary);
        in.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
        openvdb::io::setCurrentVersion(in);
        openvdb::io::setDataCompression(in, openvdb::io::COMPRESS_NONE);
        auto trees = std::make_unique<Trees>();
        for (NodeTree* tree : {&trees->to_void, &trees->to_solid}) {
            tree->readTopology(in);
            tree->readBuffers(in);
        }
        if (static_cast<std::size_t>(in.tellg()) != bytes.size()) return damaged();
        trees_ = std::move(trees);
        return {};
    } catch (const std::exception&) {
        return damaged();
    }
}

}  // namespace terrane::internal
