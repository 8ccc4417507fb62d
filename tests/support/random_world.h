// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <memory>
#include <string>
#include <vector>

namespace terrane::test {

/// A small random world with some of its chunks: 1 to 9 roots, 1 to 5 levels, fractal or waves, any scale. The chunks
/// are made once: all roots and random branches, so that all levels occur.
class RandomWorld {
public:
    /// @param chunk_count largest number of chunks besides the roots
    RandomWorld(Random& random, int chunk_count);

    const HeightSource& source() const { return *source_; }
    const Lattice& lattice() const { return source_->lattice(); }
    /// In an order that puts parents before their children.
    const std::vector<std::shared_ptr<const Chunk>>& chunks() const { return chunks_; }
    /// Index in chunks() of a chunk's parent; a root is its own parent.
    std::size_t parent(std::size_t i) const { return parents_[i]; }
    /// Number of triangles of the mesh of the roots alone.
    std::size_t root_triangles() const;
    std::string describe() const;

private:
    std::shared_ptr<const HeightSource> source_;
    std::vector<std::shared_ptr<const Chunk>> chunks_;
    std::vector<std::size_t> parents_;
};

/// A random resident set of a random world: chunks whose parents are resident, each with its own fade. Consecutive sets
/// are either similar, as in a flight, or independent.
class RandomResidence {
public:
    explicit RandomResidence(const RandomWorld& world);

    /// Makes an independent set with random fades.
    void jump(Random& random);
    /// Loads and evicts a few chunks and continues the fades.
    void step(Random& random);
    /// The next frame of a flight: a set and a view that are independent of those before, or similar.
    ///
    /// @param before view of the frame before; null for the first
    View fly(Random& random, const View* before);
    std::shared_ptr<const ResidentSet> resident() const { return resident_; }

private:
    void make_set(bool has_same_chunks);

    const RandomWorld& world_;
    std::vector<bool> is_in_;
    std::vector<float> fades_;
    std::shared_ptr<const ResidentSet> resident_;
    std::uint64_t epoch_ = 0;
};

/// A random valid view. One in three is extreme: below the ground, at a vertex, 1e9 m away, straight up or down, a
/// field of view of 1e-3 to 3.1.
View random_view(Random& random, const RandomWorld& world);

/// A view a little ahead of another.
View moved_view(Random& random, const RandomWorld& world, const View& view);

/// A random size, uniform in its logarithm.
double random_magnitude(Random& random, double low, double high);

/// Describes the first difference between two frames; "" if all triangles and offsets have the same bits.
std::string find_difference(const TerrainMesh& a, const TerrainMesh& b);

}  // namespace terrane::test
