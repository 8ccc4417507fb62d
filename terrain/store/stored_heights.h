// SPDX-License-Identifier: MIT
#pragma once

#include "chunk_reader.h"

#include <terrane/terrain/height_source.h>

#include <memory>

namespace terrane::internal {

/// A store as a source. Bounds beyond the world, or of coarser spacings than its root squares have, are the whole range
/// of heights.
class StoredHeights final : public HeightSource {
public:
    explicit StoredHeights(std::unique_ptr<const ChunkReader> reader);

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override;

private:
    using ChunkResult = Result<std::shared_ptr<const Chunk>>;
    /// A sample or a cell of a chunk.
    struct SampleAddress {
        ChunkKey key;
        int column = 0, row = 0;
    };
    bool contains(LatticePoint point) const;
    LatticePoint nearest(LatticePoint point) const;
    SampleAddress find_sample(int level, LatticePoint point) const;
    SampleAddress find_cell(int level, LatticePoint corner) const;
    /// The level of a step; -1 for steps above that of the root squares' samples.
    int level_of(std::int64_t step) const;
    /// Upper bound of every deviation.
    float widest() const;
    Result<float> vertex_bound(LatticePoint point, std::int64_t step) const;

    std::unique_ptr<const ChunkReader> reader_;
    std::vector<double> distances_;
    HeightInterval range_;
};

}  // namespace terrane::internal
