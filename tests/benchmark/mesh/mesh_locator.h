// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::bench {

/// Finds the triangle over a point of a mesh by walking down the bisection from the roots until it
/// reaches a triangle of the mesh. Independent of the triangulator except for the bisection rule.
class MeshLocator {
public:
    /// @param mesh  must outlive the locator
    MeshLocator(const TerrainMesh& mesh, const Lattice& lattice);

    /// Displayed height of a point of the world, metres; nothing where no triangle is found.
    std::optional<double> displayed_height(double x, double y) const;

    /// Triangles that are no halves of a bisected square, or are there twice.
    std::size_t stray_count() const { return stray_count_; }

private:
    struct Corner {
        LatticePoint point;
        double height = 0.0;
    };
    struct Found {
        std::uint64_t key = 0;  ///< 0: none
        std::uint32_t part = 0;
        std::uint32_t first_index = 0;
    };

    static std::uint64_t key_of(const LatticePoint& apex, const LatticePoint& left,
                                const LatticePoint& right);
    Corner corner(const MeshChunk& part, std::uint32_t index) const;
    void insert(const Found& found);
    const Found* find(std::uint64_t key) const;

    TerrainMesh mesh_;
    Lattice lattice_;
    std::vector<Found> table_;  ///< open addressing, a power of two long
    std::size_t stray_count_ = 0;
};

}  // namespace terrane::bench
