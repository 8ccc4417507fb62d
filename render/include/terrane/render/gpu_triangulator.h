// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/offscreen.h>
#include <terrane/terrain/triangulator.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>

namespace terrane {

/// The triangles of Triangulator, selected by compute shaders: the same triangles with the same offsets, bit for bit,
/// on the device.
///
/// The chunks that a view refines are uploaded once, and stay on the device while they are resident. See docs/gpu.md.
class GpuTriangulator {
public:
    /// Compiles the shaders, and probes the arithmetic of the device.
    ///
    /// @param source must outlive the triangulator
    ///
    /// Fails: as Triangulator::create(); device_unavailable if the device does not compile the shaders or does not
    ///        round as IEEE 754, or the world has more than 4096 resident root squares
    static Result<GpuTriangulator> create(const GlContext& context, const HeightSource& source,
                                          const TriangulatorSettings& settings);

    GpuTriangulator(GpuTriangulator&&) noexcept;
    GpuTriangulator& operator=(GpuTriangulator&&) noexcept;
    ~GpuTriangulator();

    /// Computes the mesh of a view over the resident chunks. Triangles of the heightfield stay on the device
    /// (TerrainMesh::device), where TerrainRenderer draws them: the mesh has no chunks and no indices. Triangles of
    /// volumes are in its `solids`, as from Triangulator::update(). Valid until the next call.
    ///
    /// @param others as for Triangulator::update()
    ///
    /// Fails:   invalid_argument for an invalid view; device_unavailable if the device's memory does not suffice
    /// Threads: only the one on which the context is current
    Result<TerrainMesh> update(std::shared_ptr<const ResidentSet> resident, const View& view,
                               std::span<const TriangleDemand> others = {});

    /// Copies the mesh of the last update() to memory, with chunks, indices and offsets as Triangulator::update() makes
    /// them. Empty if update() failed. Valid until the next call.
    ///
    /// Cost: waits for the device, and copies indices and offsets
    Result<TerrainMesh> read();

    /// Whether a place is above the triangles of the last update(): false if none is above or below it. For
    /// HorizonMap::holds_for().
    ///
    /// Fails: device_unavailable
    /// Cost:  waits for the device; O(triangles of the chunks below the place)
    Result<bool> is_above_ground(const WorldPos& place);

    /// Changes all settings from the next update() on. Fails as Triangulator::create(); nothing is changed then.
    Result<void> change(const TriangulatorSettings& settings);

    /// Areas of 16 x 16 cells whose vertices the last update() visited: its work is proportional to them.
    std::size_t area_count() const;
    /// Device time of the last update(), milliseconds; of an earlier one if its time has not been reported.
    std::optional<double> gpu_ms() const;
    /// Memory on the device, bytes.
    std::size_t device_bytes() const;
    /// Bytes that the last update() uploaded besides chunks.
    std::size_t uploaded_bytes() const;

private:
    struct State;
    explicit GpuTriangulator(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
