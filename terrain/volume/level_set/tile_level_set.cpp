// SPDX-License-Identifier: MIT
#include "level_set/tile_level_set.h"

#include "level_set/sampled_grid.h"

#include <terrane/base/text.h>

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>
#include <openvdb/tree/InternalNode.h>
#include <openvdb/tree/LeafNode.h>
#include <openvdb/tree/RootNode.h>
#include <openvdb/tree/Tree.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <sstream>

namespace terrane::internal {

inline constexpr int kLeafSide = 4, kLeafNodes = 64;
using NodeLeaf = openvdb::tree::LeafNode<std::int16_t, 2>;
using NodeTree =
    openvdb::tree::Tree<openvdb::tree::RootNode<openvdb::tree::InternalNode<NodeLeaf, 2>>>;

/// Runs work that OpenVDB would divide among threads, such as copying or freeing a tree, on the calling thread only:
/// tiles are already divided among threads, and a frame's thread must not wait for others.
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

Result<TileLines> TileLines::create(const Lattice& lattice, int level, const VolumeTileKey& key,
                                    std::span<const std::int32_t> heights) {
    const std::int64_t step = lattice.step(level);
    TileLines lines;
    lines.spacing = lattice.level_spacing(level);
    lines.west = key.column * kVolumeTileCells;
    lines.south = key.row * kVolumeTileCells;
    const auto name = [&] {
        return "tile (" + number_text(key.column) + ", " + number_text(key.row) + ")";
    };
    if (lines.west * step < lattice.west() ||
        (lines.west + kVolumeTileCells) * step > lattice.east() ||
        lines.south * step < lattice.south() ||
        (lines.south + kVolumeTileCells) * step > lattice.north()) {
        return fail(ErrorCode::invalid_argument, name() + " is not of the world");
    }
    if (heights.size() != kTileLines) {
        return fail(ErrorCode::invalid_argument,
                    name() + " has 33 * 33 heights, got " + number_text(heights.size()));
    }
    for (std::size_t i = 0; i < kVolumeTileSamples; ++i) {
        lines.x[i] = lattice.x((lines.west + static_cast<std::int64_t>(i)) * step);
        lines.y[i] = lattice.y((lines.south + static_cast<std::int64_t>(i)) * step);
    }
    for (std::size_t line = 0; line < kTileLines; ++line) {
        const double height = static_cast<double>(heights[line]) * lattice.quantum;
        const double k = std::floor(height / lines.spacing + 0.5);
        if (!(std::abs(k) < kMostNode)) {
            return fail(
                ErrorCode::invalid_argument,
                name() + " has a height of " + number_text(height) + " m, beyond 2^28 spacings");
        }
        lines.height[line] = height;
        lines.surface[line] = static_cast<std::int32_t>(k);
        lines.offset[line] = height - k * lines.spacing;
    }
    return lines;
}

namespace {

int leaf_of(double node) { return static_cast<int>(std::floor(node / kLeafSide)); }

/// A box of leaves; the upper end is excluded.
struct LeafBox {
    Eigen::Vector3i low, high;
    bool is_empty() const { return low[0] >= high[0] || low[1] >= high[1] || low[2] >= high[2]; }
    bool is_leaf() const { return high - low == Eigen::Vector3i::Ones(); }
};

using LeafValues = std::array<std::int16_t, kLeafNodes>;

// Replaces each value of a leaf by the smaller (if `keeps_least`) or larger of it and the value in `distances`.
void combine_leaf(NodeTree& tree, const openvdb::Coord& origin, const LeafValues& distances,
                  bool keeps_least) {
    const auto limit = static_cast<std::int16_t>(
        keeps_least ? -kBandSteps : kBandSteps);  // neutral for the combination
    NodeLeaf* leaf = tree.probeLeaf(origin);
    if (leaf == nullptr) {
        if (tree.getValue(origin) == limit) return;
        const auto changes = [&](std::int16_t d) {
            return keeps_least ? d < kBandSteps : d > -kBandSteps;
        };
        if (std::ranges::none_of(distances, changes)) return;
        leaf = tree.touchLeaf(origin);
    }
    bool all_at_limit = true;
    for (openvdb::Index i = 0; i < kLeafNodes; ++i) {
        const std::int16_t was = leaf->getValue(i), d = distances[i];
        const std::int16_t value = keeps_least ? std::min(was, d) : std::max(was, d);
        leaf->setValueOnly(i, value);
        leaf->setActiveState(i, std::abs(value) < kBandSteps);
        all_at_limit = all_at_limit && value == limit;
    }
    if (all_at_limit) tree.addTile(1, origin, limit, false);
}

void fill_leaf(NodeTree& tree, const openvdb::Coord& origin, std::int16_t value) {
    if (tree.probeConstLeaf(origin) != nullptr || tree.getValue(origin) != value) {
        tree.addTile(1, origin, value, false);
    }
}

}  // namespace

/// Applies one operation to a tile. Divides boxes of leaves until a box is beyond the band around the shape's surface,
/// or a single leaf.
class TileLevelSet::Application {
public:
    Application(TileLevelSet& level_set, VolumeOp op, const PlacedShape& shape,
                const TileLines& lines)
        : lines_(lines),
          traversal_(shape, level_set.band_),
          least_(op == VolumeOp::remove ? level_set.trees_->to_void : level_set.trees_->to_solid),
          most_(op == VolumeOp::remove ? level_set.trees_->to_solid : level_set.trees_->to_void) {}

    void visit(const LeafBox& box) {
        if (box.is_empty()) return;
        const BoxSide side = traversal_.enter(extent_of(box));
        if (side == BoxSide::inside) {
            fill(box);
        } else if (side == BoxSide::near) {
            if (box.is_leaf()) {
                combine(box.low);
            } else {
                divide(box);
            }
        }
        traversal_.leave();
    }

private:
    NodeBox extent_of(const LeafBox& box) const {
        NodeBox extent;
        for (int axis = 0; axis < 3; ++axis) {
            const double first = kLeafSide * double(box.low[axis]),
                         last = kLeafSide * double(box.high[axis]) - 1.0;
            extent.centre_world[axis] = 0.5 * (first + last) * lines_.spacing;
            // Node k is within half a spacing of z = k spacing.
            extent.half_extents[axis] =
                (0.5 * (last - first) + (axis == 2 ? 0.5 : 0.0)) * lines_.spacing;
        }
        extent.centre_world[0] += lines_.x[0];
        extent.centre_world[1] += lines_.y[0];
        return extent;
    }

    void divide(const LeafBox& box) {
        const Eigen::Vector3i size = box.high - box.low;
        const int axis = size[2] >= size[0] && size[2] >= size[1] ? 2 : size[0] >= size[1] ? 0 : 1;
        LeafBox low = box, high = box;
        low.high[axis] = high.low[axis] = box.low[axis] + size[axis] / 2;
        visit(low);
        visit(high);
    }

    void fill(const LeafBox& box) {
        for (int x = box.low[0]; x < box.high[0]; ++x) {
            for (int y = box.low[1]; y < box.high[1]; ++y) {
                for (int z = box.low[2]; z < box.high[2]; ++z) {
                    const openvdb::Coord origin(kLeafSide * x, kLeafSide * y, kLeafSide * z);
                    fill_leaf(least_, origin, -kBandSteps);
                    fill_leaf(most_, origin, kBandSteps);
                }
            }
        }
    }

    void combine(const Eigen::Vector3i& at) {
        const openvdb::Coord origin(kLeafSide * at[0], kLeafSide * at[1], kLeafSide * at[2]);
        // Nodes beyond the tile's last line are left unchanged.
        std::array<Eigen::Vector3d, kLeafNodes> nodes;
        std::array<std::size_t, kLeafNodes> index;
        std::size_t count = 0;
        for (int x = 0; x < kLeafSide; ++x) {
            for (int y = 0; y < kLeafSide; ++y) {
                if (origin[0] + x >= kVolumeTileSamples || origin[1] + y >= kVolumeTileSamples)
                    continue;
                const int line = line_index(origin[0] + x, origin[1] + y);
                for (int z = 0; z < kLeafSide; ++z) {
                    nodes[count] = lines_.position(line, origin[2] + z);
                    index[count++] = static_cast<std::size_t>((x * kLeafSide + y) * kLeafSide + z);
                }
            }
        }
        LeafValues read, distances, opposite;
        traversal_.distances({nodes.data(), count}, {read.data(), count});
        distances.fill(kBandSteps);
        for (std::size_t i = 0; i < count; ++i) distances[index[i]] = read[i];
        std::ranges::transform(distances, opposite.begin(),
                               [](std::int16_t d) { return static_cast<std::int16_t>(-d); });
        combine_leaf(least_, origin, distances, true);
        combine_leaf(most_, origin, opposite, false);
    }

    const TileLines& lines_;
    ShapeTraversal traversal_;
    NodeTree& least_;  // tree of the field that becomes negative inside the shape
    NodeTree& most_;
};

TileLevelSet::TileLevelSet(double spacing)
    : trees_(std::make_unique<Trees>()), band_(kBandSpacings * spacing) {}

TileLevelSet::~TileLevelSet() = default;

void TileLevelSet::apply(VolumeOp op, const PlacedShape& shape, const TileLines& lines) {
    const Aabb& bounds = shape.bounds();
    const double s = lines.spacing, reach = band_ + s;
    constexpr int last_leaf = (kVolumeTileSamples - 1) / kLeafSide;
    LeafBox box;
    for (int axis = 0; axis < 3; ++axis) {
        const double origin = axis == 0 ? lines.x[0] : axis == 1 ? lines.y[0] : 0.0;
        // Clamped before the conversion: a large shape may extend far beyond the tile.
        const double low =
            std::clamp((bounds.low[axis] - reach - origin) / s, -kMostNode, kMostNode);
        const double high =
            std::clamp((bounds.high[axis] + reach - origin) / s, -kMostNode, kMostNode);
        box.low[axis] = axis == 2 ? leaf_of(low) : std::max(leaf_of(low), 0);
        box.high[axis] = (axis == 2 ? leaf_of(high) : std::min(leaf_of(high), last_leaf)) + 1;
    }
    Application(*this, op, shape, lines).visit(box);
}

std::int16_t TileLevelSet::value(Field field, int line, std::int32_t k) const {
    return trees_->of(field).getValue(
        openvdb::Coord(line % kVolumeTileSamples, line / kVolumeTileSamples, k));
}

FieldRuns TileLevelSet::runs(Field field, const TileLines& lines) const {
    const NodeTree& tree = trees_->of(field);
    struct Piece {
        int line, k;
        const std::int16_t* values;
    };
    // Leaves are visited in the order of their coordinates, so that the pieces of each line ascend.
    std::vector<Piece> pieces;
    std::vector<std::uint32_t> counts(kTileLines + 1, 0);
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord& origin = leaf->origin();
        const std::int16_t* values = leaf->buffer().data();
        for (int x = 0; x < kLeafSide && origin[0] + x < kVolumeTileSamples; ++x) {
            for (int y = 0; y < kLeafSide && origin[1] + y < kVolumeTileSamples; ++y) {
                const int line = line_index(origin[0] + x, origin[1] + y);
                pieces.push_back({line, origin[2], values + (x * kLeafSide + y) * kLeafSide});
                ++counts[static_cast<std::size_t>(line) + 1];
            }
        }
    }
    for (std::size_t line = 0; line < kTileLines; ++line) counts[line + 1] += counts[line];
    std::vector<const Piece*> sorted(pieces.size());
    std::vector<std::uint32_t> next = counts;
    for (const Piece& piece : pieces) sorted[next[static_cast<std::size_t>(piece.line)]++] = &piece;

    FieldRuns runs;
    runs.line_begin.push_back(0);
    runs.far_value.assign(kTileLines, kBandSteps);
    for (int line = 0; line < kTileLines; ++line) {
        const auto l = static_cast<std::size_t>(line);
        for (std::uint32_t i = counts[l]; i < counts[l + 1]; ++i) {
            const Piece& piece = *sorted[i];
            if (i > counts[l] && runs.runs.back().last + 1 == piece.k) {
                runs.runs.back().last += kLeafSide;
            } else {
                runs.runs.push_back({piece.k, piece.k + kLeafSide - 1,
                                     static_cast<std::uint32_t>(runs.values.size())});
            }
            runs.values.insert(runs.values.end(), piece.values, piece.values + kLeafSide);
        }
        if (counts[l] == counts[l + 1]) runs.far_value[l] = value(field, line, lines.surface[l]);
        runs.line_begin.push_back(static_cast<std::uint32_t>(runs.runs.size()));
    }
    return runs;
}

std::size_t TileLevelSet::bytes() const {
    return alone([this] {
        return sizeof(Trees) + trees_->to_void.memUsage() + trees_->to_solid.memUsage();
    });
}

std::uint64_t TileLevelSet::band_node_count() const {
    return alone([this] {
        return trees_->to_void.activeVoxelCount() + trees_->to_solid.activeVoxelCount();
    });
}

// Serialisation of level sets.

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
