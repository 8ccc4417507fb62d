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

/// A small world of random shape: 1 to 9 roots, 1 to 5 levels, fractal or waves, any scale. Some of
/// its chunks, made once: roots and random branches, so that all levels occur.
class RandomWorld {
public:
    /// @param chunk_count most chunks besides the roots
    RandomWorld(Random& random, int chunk_count);

    const HeightSource& source() const { return *source_; }
    const Lattice& lattice() const { return source_->lattice(); }
    /// Parents come before their children.
    const std::vector<std::shared_ptr<const Chunk>>& chunks() const { return chunks_; }
    /// Index of a chunk's parent in chunks(); of a root its own.
    std::size_t parent(std::size_t i) const { return parents_[i]; }
    /// Triangles of a mesh of bare roots.
    std::size_t root_triangles() const;
    std::string describe() const;

private:
    std::shared_ptr<const HeightSource> source_;
    std::vector<std::shared_ptr<const Chunk>> chunks_;
    std::vector<std::size_t> parents_;
};

/// A resident set of a random world: any chunks with resident parents, each with its own fade. Consecutive states are
/// similar, as in a flight, or unrelated.
class RandomResidence {
public:
    explicit RandomResidence(const RandomWorld& world);

    /// Any set at all, with any fades.
    void jump(Random& random);
    /// A few loads, a few evictions, and fades that go on.
    void step(Random& random);
    std::shared_ptr<const ResidentSet> resident() const { return resident_; }

private:
    void make_set(bool has_same_chunks);

    const RandomWorld& world_;
    std::vector<bool> is_in_;
    std::vector<float> fades_;
    std::shared_ptr<const ResidentSet> resident_;
    std::uint64_t epoch_ = 0;
};

/// Any valid view: ordinary ones, and one in three extreme: under the ground, in a vertex, 1e9 m away, straight up
/// and down, fields of view of 1e-3 to 3.1.
View random_view(Random& random, const RandomWorld& world);

/// A view a little further on.
View moved_view(Random& random, const RandomWorld& world, const View& view);

/// Sizes of any order of magnitude between two.
double random_magnitude(Random& random, double low, double high);

/// The difference of two frames; "" if every triangle and offset has the same bits.
std::string find_difference(const TerrainMesh& a, const TerrainMesh& b);

}  // namespace terrane::test
