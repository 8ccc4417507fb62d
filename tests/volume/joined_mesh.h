// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>
#include <terrane/volume/volume_tile.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace terrane::test {

/// A world of one level, whose heights are a function of column and row.
struct VolumeWorld {
    Lattice lattice;
    std::vector<std::int32_t> heights;  // row by row from the south-west, quanta
    int columns = 0, rows = 0;          // samples

    /// @param height metres, of column and row
    static VolumeWorld make(int chunk_columns, double spacing,
                            const std::function<double(int, int)>& height);

    double sample(int column, int row) const {
        return lattice.quantum * heights[static_cast<std::size_t>(row * columns + column)];
    }
    /// Of the triangles between the samples.
    double height(double x, double y) const;
    std::vector<std::int32_t> tile_heights(const VolumeTileKey& key) const;
    /// Lowest and highest sample of the cell under a place.
    std::array<double, 2> cell_range(double x, double y) const;
};

/// The contours of all tiles and the triangles of the heightfield that they do not replace, with each vertex once.
struct JoinedMesh {
    std::vector<VolumeVertexKey> keys;
    std::vector<WorldPos> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::string fault;  // of tiles that disagree
};

JoinedMesh join(const VolumeWorld& world, const Volumes& volumes,
                const std::vector<VolumeContour>& contours);
/// Contours of all tiles of the volumes.
std::vector<VolumeContour> contour_all(const VolumeWorld& world, const Volumes& volumes);

/// Empty, or what is wrong: an edge off the world's border that does not have exactly one triangle in each direction, a
/// triangle with two equal vertices, a vertex whose position is not finite.
std::string find_leak(const VolumeWorld& world, const JoinedMesh& mesh);

/// Volume between the mesh and z = 0, cubic metres: of the solid above z = 0.
double signed_volume(const JoinedMesh& mesh);

/// Finds how often vertical lines pass through a mesh.
class VerticalCrossings {
public:
    VerticalCrossings(const VolumeWorld& world, const JoinedMesh& mesh);
    /// Above a point: passages out of the solid less passages into it. 1 in the solid, 0 outside.
    int above(const Eigen::Vector3d& p_world) const;

private:
    std::size_t bin(double x, double y) const;
    const VolumeWorld& world_;
    const JoinedMesh& mesh_;
    std::vector<std::vector<std::uint32_t>> bins_;  // triangles over each cell
};

/// All triangles of a frame, chunks' and volumes', with each displayed position once, bit for bit.
struct FrameMesh {
    std::vector<WorldPos> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;

    FrameMesh() = default;
    explicit FrameMesh(const TerrainMesh& mesh);

    /// Empty, or what is wrong: an inner edge that does not have exactly one triangle in each direction, a border edge
    /// that is not on the world's border, a triangle with two equal vertices, a count that is not the mesh's.
    std::string find_flaw(const TerrainMesh& mesh) const;

    /// Adds the surface of a chunk at its finest: its solid's triangles, and its heightfield's that these do not
    /// replace.
    void add_finest(const Lattice& lattice, const Chunk& chunk);

    /// The triangle that is nearest to a point, by brute force, and its distance, metres.
    struct Nearest {
        double distance = std::numeric_limits<double>::infinity();
        std::size_t triangle = 0;
    };
    Nearest nearest(const Eigen::Vector3d& p_world) const;
};

}  // namespace terrane::test
