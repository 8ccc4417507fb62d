// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace terrane::bench {

/// A frame's mesh that outlives the next update().
class MeshCopy {
public:
    MeshCopy() = default;
    explicit MeshCopy(const TerrainMesh& mesh);
    MeshCopy(MeshCopy&&) noexcept = default;
    MeshCopy& operator=(MeshCopy&&) noexcept = default;

    /// As a mesh again, valid as long as the copy is.
    TerrainMesh view() const;
    bool is_empty() const { return parts.empty(); }

    std::vector<MeshChunk> parts;  ///< their offsets point into `offsets`
    std::vector<std::uint16_t> indices;
    std::vector<std::vector<float>> offsets;  ///< of each part; empty where it has none

private:
    TerrainMesh numbers_;
};

/// What differs between two meshes of the same resident set, or "" where nothing does: chunks and
/// their order, triangles, offsets of the samples that are used, bit for bit, error_px, status.
std::string find_difference(const TerrainMesh& a, const TerrainMesh& b);

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

/// Result of a measurement by brute force.
struct Measured {
    double error_px = 0.0;   ///< largest screen error of a ground point inside the side planes
    std::size_t points = 0;  ///< inside the side planes
};

/// Samples 4 x 4 points a cell of the finest level in triangles up to 8 cells wide, the corners
/// of up to 64 x 64 parts of larger ones; on fractal ground, whose finest cells are too many,
/// those of 12 x 12 parts. The worst 256 triangles get four times as many along each axis, on fractal
/// ground eight times.
Measured measure_densely(const TerrainMesh& mesh, const HeightSource& source, const View& view,
                         bool is_fractal);

/// Largest vertical distance of a sample of a table from what is displayed, metres.
double measure_samples(const TerrainMesh& mesh, const test::TableHeights& source);

}  // namespace terrane::bench
