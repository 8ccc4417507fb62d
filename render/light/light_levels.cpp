// SPDX-License-Identifier: MIT
#include "light/light_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace terrane::internal {
namespace {

ChunkKey neighbour(const ChunkKey& key, int side) {
    constexpr std::array<std::int32_t, 4> kX{-1, 1, 0, 0};
    constexpr std::array<std::int32_t, 4> kY{0, 0, -1, 1};
    const auto at = static_cast<std::size_t>(side);
    return {key.x + kX[at], key.y + kY[at], key.level};
}

// The ancestor of a chunk at `level`; the chunk itself if that is its own level.
ChunkKey ancestor(ChunkKey key, int level) {
    while (key.level > level) key = key.parent();
    return key;
}

// Heights of a chunk and of its four neighbours, by column and row in the chunk.
class Heights {
public:
    Heights(const ResidentSet& resident, const Chunk& chunk, const SideLevels& side_levels)
        : chunk_(chunk) {
        for (int side = 0; side < 4; ++side) {
            const int level = side_levels[static_cast<std::size_t>(side)];
            if (level < 0) continue;
            const std::int32_t index = resident.find(ancestor(neighbour(chunk.key, side), level));
            around_[static_cast<std::size_t>(side)] =
                resident.chunks()[static_cast<std::size_t>(index)].get();
        }
    }

    // `column` or `row`, not both, may be up to 128 samples beyond the edges. None if no chunk has the sample.
    std::optional<std::int32_t> at(int column, int row) const {
        int side = -1;
        if (column < 0) side = 0;
        if (column > kChunkCells) side = 1;
        if (row < 0) side = 2;
        if (row > kChunkCells) side = 3;
        if (side < 0) return chunk_.heights[sample_index(column, row)];
        const Chunk* other = around_[static_cast<std::size_t>(side)];
        if (other == nullptr) return std::nullopt;
        const std::int64_t x = chunk_.corner.x + column * chunk_.step - other->corner.x;
        const std::int64_t y = chunk_.corner.y + row * chunk_.step - other->corner.y;
        if (x % other->step != 0 || y % other->step != 0) return std::nullopt;
        return other->heights[sample_index(static_cast<int>(x / other->step),
                                           static_cast<int>(y / other->step))];
    }

private:
    const Chunk& chunk_;
    std::array<const Chunk*, 4> around_{};
};

// Rise per sample spacing, quanta: the central difference between the heights `baseline` samples before and after the
// middle; one-sided if one of them is absent.
double rise(std::int32_t middle, std::optional<std::int32_t> before,
            std::optional<std::int32_t> after, int baseline) {
    const double last = after.value_or(middle);
    const double first = before.value_or(middle);
    const int width = (after ? baseline : 0) + (before ? baseline : 0);
    return width == 0 ? 0.0 : (last - first) / width;
}

// Mean of the heights before and after the middle, minus that of the middle, quanta; 0 if one of them is absent.
double sag(std::int32_t middle, std::optional<std::int32_t> before,
           std::optional<std::int32_t> after) {
    if (!before || !after) return 0.0;
    return 0.5 * (static_cast<double>(*before) + static_cast<double>(*after)) - middle;
}

std::int16_t to_signed_16(double component) {
    return static_cast<std::int16_t>(std::lround(component * 32767.0));
}

}  // namespace

SideLevels find_side_levels(const ResidentSet& resident, const ChunkKey& key) {
    SideLevels levels{-1, -1, -1, -1};
    for (int side = 0; side < 4; ++side) {
        const ChunkKey beside = neighbour(key, side);
        for (int level = key.level; level >= 0; --level) {
            if (resident.find(ancestor(beside, level)) == ResidentSet::kNone) continue;
            levels[static_cast<std::size_t>(side)] = level;
            break;
        }
    }
    return levels;
}

std::vector<std::int16_t> make_slope_map(const ResidentSet& resident, const Chunk& chunk,
                                         const SideLevels& side_levels) {
    const Heights heights(resident, chunk, side_levels);
    const Lattice& lattice = resident.lattice();
    const double slope_per_rise =
        lattice.quantum / (lattice.spacing * static_cast<double>(chunk.step));
    std::vector<std::int16_t> map(std::size_t{2} * kSlopeMapWidth * kSlopeMapHeight, 0);
    for (int layer = 0; layer < kSlopeLayers; ++layer) {
        const int baseline = 1 << layer;
        for (int row = 0; row <= kChunkCells; row += baseline) {
            std::size_t out = std::size_t{2} * kSlopeMapWidth *
                              static_cast<std::size_t>(slope_layer_row(layer) + row / baseline);
            for (int column = 0; column <= kChunkCells; column += baseline) {
                const std::int32_t middle = chunk.heights[sample_index(column, row)];
                const double east =
                    slope_per_rise * rise(middle, heights.at(column - baseline, row),
                                          heights.at(column + baseline, row), baseline);
                const double north =
                    slope_per_rise * rise(middle, heights.at(column, row - baseline),
                                          heights.at(column, row + baseline), baseline);
                const double scale = 1.0 / std::sqrt(east * east + north * north + 1.0);
                map[out++] = to_signed_16(-east * scale);
                map[out++] = to_signed_16(-north * scale);
            }
        }
    }
    return map;
}

std::vector<std::int16_t> make_bend_map(const ResidentSet& resident, const Chunk& chunk,
                                        const SideLevels& side_levels) {
    const Heights heights(resident, chunk, side_levels);
    const Lattice& lattice = resident.lattice();
    const double per_sag =
        0.5 * lattice.quantum / (lattice.spacing * static_cast<double>(chunk.step));
    std::vector<std::int16_t> map(std::size_t{kSlopeMapWidth} * kSlopeMapHeight, 0);
    for (int layer = 0; layer < kSlopeLayers; ++layer) {
        const int baseline = 1 << layer;
        for (int row = 0; row <= kChunkCells; row += baseline) {
            std::size_t out = std::size_t{kSlopeMapWidth} *
                              static_cast<std::size_t>(slope_layer_row(layer) + row / baseline);
            for (int column = 0; column <= kChunkCells; column += baseline) {
                const std::int32_t middle = chunk.heights[sample_index(column, row)];
                const double sags = sag(middle, heights.at(column - baseline, row),
                                        heights.at(column + baseline, row)) +
                                    sag(middle, heights.at(column, row - baseline),
                                        heights.at(column, row + baseline));
                map[out++] = to_signed_16(std::clamp(per_sag / baseline * sags, -1.0, 1.0));
            }
        }
    }
    return map;
}

namespace {

constexpr double kNearMovements =
    10.0;  // least distance at which a chunk fades in, in eye movements per frame
constexpr float kFadeStep = 1.0f / LightLevels::kFadeFrames;
constexpr int kNoLevel = std::numeric_limits<int>::max();

struct ChunkBox {
    WorldPos low, high;
};

// Bounding box of the displayed ground of a chunk.
ChunkBox box_of(const Lattice& lattice, const Chunk& chunk) {
    const std::int64_t side = lattice.chunk_side(chunk.key.level);
    const auto bound = static_cast<double>(chunk.max_vertex_bound);
    return {
        {lattice.x(chunk.corner.x), lattice.y(chunk.corner.y), lattice.quantum * chunk.low - bound},
        {lattice.x(chunk.corner.x + side), lattice.y(chunk.corner.y + side),
         lattice.quantum * chunk.high + bound}};
}

double nearest_distance(const ChunkBox& box, const WorldPos& p) {
    return (p - p.cwiseMax(box.low).cwiseMin(box.high)).norm();
}

double farthest_distance(const ChunkBox& box, const WorldPos& p) {
    return (p - box.low).cwiseAbs().cwiseMax((p - box.high).cwiseAbs()).norm();
}

bool is_same(const std::weak_ptr<const Chunk>& chunk, const std::shared_ptr<const Chunk>& now) {
    return !chunk.owner_before(now) && !now.owner_before(chunk);
}

}  // namespace

LightLevels::LightLevels(int max_chunks) {
    for (int layer = max_chunks; layer-- > 0;) free_layers_.push_back(layer);
}

void LightLevels::update(const std::shared_ptr<const ResidentSet>& resident, const View& view) {
    ++frame_;
    follow(resident, view);
    fade(*resident);
    choose(*resident, view);
    for (LitChunk& chunk : lit_) chunk.nodes = make_nodes(*resident, chunk);
    last_eye_ = view.eye_world;
}

std::size_t LightLevels::layer_count() const {
    return static_cast<std::size_t>(
        std::count_if(record_of_.begin(), record_of_.end(),
                      [](const Record* record) { return record->layer >= 0; }));
}

// Updates the records for the resident chunks.
void LightLevels::follow(const std::shared_ptr<const ResidentSet>& resident, const View& view) {
    const std::shared_ptr<const ResidentSet> last = followed_.lock();
    followed_ = resident;
    if (last != nullptr && last->has_same_chunks(*resident)) return;
    for (auto entry = records_.begin(); entry != records_.end();) {
        const std::int32_t index = resident->find(entry->first);
        if (index != ResidentSet::kNone &&
            is_same(entry->second.chunk, resident->chunks()[static_cast<std::size_t>(index)])) {
            ++entry;
            continue;
        }
        if (entry->second.layer >= 0) free_layers_.push_back(entry->second.layer);
        entry = records_.erase(entry);
    }
    const double eye_movement = (view.eye_world - last_eye_).norm();
    record_of_.clear();
    for (std::size_t i = 0; i < resident->chunks().size(); ++i) {
        const std::shared_ptr<const Chunk>& chunk = resident->chunks()[i];
        const auto [at, is_new] = records_.try_emplace(chunk->key);
        Record& record = at->second;
        record_of_.push_back(&record);
        if (!is_new) continue;
        record.chunk = chunk;
        record.first_frame = frame_;
        record.fade = resident->fade(i);
        const std::int32_t parent = resident->links(i).parent;
        if (parent == ResidentSet::kNone) continue;
        // parents precede their children
        const bool fades_in = record_of_[static_cast<std::size_t>(parent)]->first_frame < frame_ &&
                              farthest_distance(box_of(resident->lattice(), *chunk),
                                                view.eye_world) >= kNearMovements * eye_movement;
        if (fades_in) record.presence = 0.0f;
    }
}

void LightLevels::fade(const ResidentSet& resident) {
    for (std::size_t i = 0; i < record_of_.size(); ++i) {
        Record& record = *record_of_[i];
        const float now = resident.fade(i);
        if (now != record.fade) record.is_leaving = now < record.fade;
        record.fade = now;
        record.presence =
            std::clamp(record.presence + (record.is_leaving ? -kFadeStep : kFadeStep), 0.0f, 1.0f);
    }
}

void LightLevels::choose(const ResidentSet& resident, const View& view) {
    const Lattice& lattice = resident.lattice();
    const double radians_per_pixel = 1.0 / view.pixels_per_radian();
    lit_.clear();
    lit_indices_.clear();
    starved_level_ = kNoLevel;
    const auto light = [&](std::size_t index) {
        Record& record = *record_of_[index];
        const Chunk& chunk = *resident.chunks()[index];
        if (record.layer < 0 && !allocate_layer(record)) {
            starved_level_ = chunk.key.level;
            return false;
        }
        record.lit_frame = frame_;
        record.lit_index = static_cast<int>(lit_.size());
        lit_.push_back({chunk.key, &chunk, record.layer, {}});
        lit_indices_.push_back(static_cast<std::int32_t>(index));
        return true;
    };
    for (std::size_t i = 0; i < resident.chunks().size(); ++i) {
        if (resident.chunks()[i]->key.level > 0 || !light(i)) break;
    }
    for (std::size_t i = 0; i < lit_indices_.size() && starved_level_ == kNoLevel; ++i) {
        const auto index = static_cast<std::size_t>(lit_indices_[i]);
        const double spacing = lattice.level_spacing(lit_[i].key.level);
        for (const std::int32_t child : resident.links(index).child) {
            if (child == ResidentSet::kNone) continue;
            const auto at = static_cast<std::size_t>(child);
            const ChunkBox box = box_of(lattice, *resident.chunks()[at]);
            if (nearest_distance(box, view.eye_world) * radians_per_pixel >= spacing) continue;
            if (!light(at)) break;
        }
    }
}

// Gives the record a free layer or, if there is none, one of a chunk that was last lit before the previous frame.
bool LightLevels::allocate_layer(Record& record) {
    if (free_layers_.empty()) {
        for (Record* other : record_of_) {
            if (other->layer < 0 || other->lit_frame + 1 >= frame_) continue;
            free_layers_.push_back(std::exchange(other->layer, -1));
        }
    }
    if (free_layers_.empty()) return false;
    record.layer = free_layers_.back();
    free_layers_.pop_back();
    return true;
}

// Presence of a chunk: 0 if it is not resident or has no layer; 1 beyond the world or its root window, so that lighting
// does not fade towards the edge.
float LightLevels::presence_at(const ResidentSet& resident, const ChunkKey& key) const {
    if (!resident.window().contains(key)) return 1.0f;
    const std::int32_t index = resident.find(key);
    if (index == ResidentSet::kNone) return 0.0f;
    const Record& record = *record_of_[static_cast<std::size_t>(index)];
    return record.lit_frame != frame_ && key.level >= starved_level_ ? 0.0f : record.presence;
}

LightNodes LightLevels::make_nodes(const ResidentSet& resident, const LitChunk& lit) const {
    LightNodes nodes{};
    if (lit.key.level == 0) return nodes;
    std::array<float, 9> presence{};
    for (int i = 0; i < 9; ++i) {
        presence[static_cast<std::size_t>(i)] =
            presence_at(resident, {lit.key.x + i % 3 - 1, lit.key.y + i / 3 - 1, lit.key.level});
    }
    const std::int32_t parent_index =
        resident.links(static_cast<std::size_t>(resident.find(lit.key))).parent;
    const Record& parent = *record_of_[static_cast<std::size_t>(parent_index)];
    const LightNodes& coarse = lit_[static_cast<std::size_t>(parent.lit_index)].nodes;
    const int quadrant = lit.key.quadrant();
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            LightNode& node = nodes[static_cast<std::size_t>(3 * row + column)];
            node.own = 1.0f;
            for (int y = std::min(row, 1); y <= std::max(row, 1); ++y) {
                for (int x = std::min(column, 1); x <= std::max(column, 1); ++x) {
                    node.own = std::min(node.own, presence[static_cast<std::size_t>(3 * y + x)]);
                }
            }
            // the parent's field at this node, interpolated from the parent's nodes around it
            const int west = (quadrant & 1) + column / 2, east = (quadrant & 1) + (column + 1) / 2;
            const int south = (quadrant >> 1) + row / 2, north = (quadrant >> 1) + (row + 1) / 2;
            const auto at = [&](int x, int y) {
                return coarse[static_cast<std::size_t>(3 * y + x)].level;
            };
            node.level = 0.25f * ((at(west, south) + at(east, south)) +
                                  (at(west, north) + at(east, north))) +
                         node.own;
        }
    }
    return nodes;
}

}  // namespace terrane::internal
