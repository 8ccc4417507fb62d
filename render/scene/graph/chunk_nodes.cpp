// SPDX-License-Identifier: MIT
#include <terrane/base/text.h>
#include <terrane/scene/chunk_nodes.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace terrane {
namespace {

// Lattice::finest_level is at most this.
constexpr int kMostLevel = 24;

/// A chunk without a node, with its priority.
struct WaitingChunk {
    double squared_distance = 0.0;
    const ResidentChunk* chunk = nullptr;
};

double squared_distance(const ChunkKey& key, const Lattice& lattice, const WorldPos& eye_world) {
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t half_side = lattice.chunk_side(key.level) / 2;
    const double x = lattice.x(corner.x + half_side) - eye_world.x();
    const double y = lattice.y(corner.y + half_side) - eye_world.y();
    return x * x + y * y;
}

/// The chunks of a level, which are consecutive in a set.
std::span<const ResidentChunk> chunks_of(const ResidentSet& resident, int level) {
    const std::span<const ResidentChunk> all = resident.chunks();
    const auto begin = std::partition_point(
        all.begin(), all.end(),
        [level](const ResidentChunk& chunk) { return chunk->key.level < level; });
    const auto end = std::partition_point(begin, all.end(), [level](const ResidentChunk& chunk) {
        return chunk->key.level == level;
    });
    return {begin, end};
}

}  // namespace

ChunkNodes::ChunkNodes(const ChunkNodesSettings& settings, NodeId parent, Make make)
    : settings_(settings), parent_(parent), make_(std::move(make)) {}

Result<ChunkNodes> ChunkNodes::create(const ChunkNodesSettings& settings, NodeId parent,
                                      Make make) {
    if (settings.level < 0 || settings.level > kMostLevel) {
        return fail(ErrorCode::invalid_argument,
                    "level must be 0 to 24, got " + number_text(settings.level));
    }
    if (settings.most_made == 0)
        return fail(ErrorCode::invalid_argument, "most_made must be at least 1, got 0");
    if (!make) return fail(ErrorCode::invalid_argument, "a function must make the content");
    return ChunkNodes(settings, parent, std::move(make));
}

void ChunkNodes::remove_gone(const ResidentSet& resident, Scene& scene) {
    for (auto each = places_.begin(); each != places_.end();) {
        const Place& place = each->second;
        if (resident.find_chunk(each->first) == place.chunk.get()) {
            ++each;
            continue;
        }
        if (place.node) {
            scene.remove(*place.node);
            ++counts_.removed;
        } else {
            --counts_.failed;
        }
        each = places_.erase(each);
    }
}

Result<NodeId> ChunkNodes::make_node(const Chunk& chunk, const Lattice& lattice,
                                     Scene& scene) const {
    const LatticePoint corner = lattice.corner(chunk.key);
    NodePlace place;
    place.parent_from_node.translation = {lattice.x(corner.x), lattice.y(corner.y), 0.0};
    TERRANE_TRY(NodeId node, scene.add(parent_, place, GroupNode{}));
    if (const Result<void> made = make_(chunk, scene, node); !made) {
        scene.remove(node);
        return tl::unexpected(made.error());
    }
    return node;
}

Result<void> ChunkNodes::update(const ResidentSet& resident, const WorldPos& eye_world,
                                Scene& scene) {
    counts_.made = counts_.removed = 0;
    if (epoch_ == resident.epoch() && counts_.waiting == 0) return {};
    if (epoch_ != resident.epoch()) remove_gone(resident, scene);
    epoch_ = resident.epoch();

    std::vector<WaitingChunk> waiting;
    for (const ResidentChunk& chunk : chunks_of(resident, settings_.level)) {
        if (places_.contains(chunk->key)) continue;
        waiting.push_back({squared_distance(chunk->key, resident.lattice(), eye_world), &chunk});
    }
    const std::size_t count = std::min(settings_.most_made, waiting.size());
    const auto order = [](const WaitingChunk& each) {
        const ChunkKey& key = (*each.chunk)->key;
        return std::tuple(each.squared_distance, key.y, key.x);
    };
    std::ranges::partial_sort(waiting, waiting.begin() + static_cast<std::ptrdiff_t>(count), {},
                              order);
    counts_.waiting = waiting.size() - count;
    Result<void> first_failure = {};
    for (const WaitingChunk& each : std::span(waiting).first(count)) {
        const ResidentChunk& chunk = *each.chunk;
        const Result<NodeId> node = make_node(*chunk, resident.lattice(), scene);
        Place& place = places_[chunk->key];
        place.chunk = chunk;
        if (node) {
            place.node = *node;
            ++counts_.made;
            continue;
        }
        ++counts_.failed;
        if (first_failure) first_failure = tl::unexpected(node.error());
    }
    return first_failure;
}

void ChunkNodes::clear(Scene& scene) {
    for (const auto& [key, place] : places_) {
        if (place.node) scene.remove(*place.node);
    }
    places_.clear();
    epoch_.reset();
    counts_ = {};
}

std::optional<NodeId> ChunkNodes::node_of(const ChunkKey& key) const {
    const auto found = places_.find(key);
    return found == places_.end() ? std::nullopt : found->second.node;
}

}  // namespace terrane
