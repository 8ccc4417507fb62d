// SPDX-License-Identifier: MIT
#pragma once

#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "terrain/imagery_squares.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Imagery of the ground on the device: squares in the layers of a texture array, and a hash table that maps the level
/// and position of a square to its layer. imagery.glsl searches the table from the finest level that a pixel needs to
/// the coarsest.
class GroundImagery {
public:
    static constexpr int kFadeFrames = 16;

    /// Bytes of a square's layer.
    static constexpr std::size_t layer_bytes();

    /// @param memory_bytes limit of the layers; at least one is held
    /// @param waits        prepare() waits for the squares it selects, and shows them without a fade
    GroundImagery(std::shared_ptr<const ImagerySource> source, std::size_t memory_bytes,
                  bool waits);

    /// Requests the squares that a view needs and uploads those that have been read, a few per frame. Call once a
    /// frame, before bind(). Fails with device_unavailable if the device is out of memory.
    Result<void> prepare(const ResidentSet& resident, const View& view);
    /// Binds table and squares to texture units 8 and 9, and the uniform block to binding 3.
    void bind() const;
    /// Call after the frame's last command that reads the table or the uniform block.
    void finish() { stream_.end(); }

    /// Squares on the device.
    std::size_t square_count() const;
    /// Squares that the source failed to read.
    std::size_t failure_count() const { return failure_count_; }
    std::size_t bytes() const { return layer_count_ * layer_bytes(); }

private:
    struct Slot {
        int layer = -1;  // -1: the source has failed
        std::uint64_t wanted_frame = 0;
        float presence = 0.0f;  // 0 to 1, fades in
    };

    void load(const ResidentSet& resident, const std::vector<ImagerySquare>& wanted);
    void upload(const ImageryLoad& load);
    int allocate_layer();
    Result<void> write_table(const Lattice& lattice, const View& view);

    std::shared_ptr<const ImagerySource> source_;
    bool waits_;
    std::size_t layer_count_;
    std::uint64_t frame_ = 0;
    Lattice lattice_;  // of the slots
    std::map<ImagerySquare, Slot> slots_;
    std::vector<int> free_layers_;
    std::vector<ImageryLoad> arrived_;  // not uploaded yet
    std::size_t failure_count_ = 0;
    GlTexture squares_, table_;
    StreamBuffer stream_;
    ImageryLoader loader_;
};

constexpr std::size_t GroundImagery::layer_bytes() {
    std::size_t texels = 0;
    for (int mipmap = 0; mipmap < kImageryMipmaps; ++mipmap)
        texels += std::size_t{kImageryTexels} * kImageryTexels >> 2 * mipmap;
    return sizeof(ImageryTexel) * texels;
}

}  // namespace terrane::internal
