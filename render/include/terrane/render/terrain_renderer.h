// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/egl_context.h>
#include <terrane/render/image.h>
#include <terrane/terrain/triangulator.h>

#include <cstdint>
#include <memory>
#include <span>

namespace terrane {

/// A colour as a screen shows it, 0 to 1.
struct Colour {
    float red = 0.0f, green = 0.0f, blue = 0.0f;
};

struct RendererSettings {
    Eigen::Vector3d sun_direction = Eigen::Vector3d(-0.5, 0.4, 0.77);  ///< towards the sun
    double haze_distance = 60'000.0;  ///< metres at which haze hides two thirds; infinity: none
    bool wireframe = false;
    /// Samples a pixel, 1 to 16; where the device does not have so many, the next that it has. With 1
    /// the edges of hills and objects are stepped, and a software rasteriser draws faster. The ground
    /// inside the edges is shaded once a pixel with any count.
    int sample_count = 4;
    double tint_low = 0.0;                ///< heights at which the tints of low and
    double tint_high = 3000.0;            ///< high ground are reached, metres
    Colour horizon{0.74f, 0.81f, 0.88f};  ///< sky at the horizon, and haze
    Colour zenith{0.22f, 0.42f, 0.72f};   ///< sky overhead
};

/// A solid that is drawn with the terrain: a part of a vehicle or of a body.
struct DrawnObject {
    enum class Form {
        box,   ///< from -extents to extents
        ball,  ///< of radius extents
        tube,  ///< round, about z, open at its ends
    };
    Form form = Form::box;
    Pose world_from_object;
    Eigen::Vector3d extents = Eigen::Vector3d::Constant(0.5);  ///< half, along its axes, metres
    Colour colour{0.8f, 0.2f, 0.1f};
};

/// Draws meshes of a Triangulator off screen.
///
/// Keeps the heights and slopes of each chunk that was drawn on the device for as long as the chunk
/// is resident; indices, and offsets where the mesh morphs, are sent every frame. Positions relative
/// to the eye are subtracted in integers before they become float: nothing jitters far from the
/// origin, and chunks of different levels meet bit for bit, morphing included.
///
/// Light follows the samples at the size of a pixel, as far as they are resident, whichever chunk or
/// triangle shows them. Where finer samples end it goes over to the coarser ones within half a chunk, and
/// where a chunk arrives within 16 calls of draw(): so a picture depends on the calls before, as the
/// pager's fades do. The first one, and one after a jump of the eye, show all there is.
///
/// Threads: the one whose context is current, from create() to the destructor.
class TerrainRenderer {
public:
    /// Fails with invalid_argument for a size below 1 or above what the device takes (at most 2^26
    /// pixels together) and for settings that are not finite or out of range, device_unavailable
    /// where shaders or buffers cannot be made.
    static Result<TerrainRenderer> create(EglContext& context, int width_px, int height_px,
                                          const RendererSettings& settings);
    TerrainRenderer(TerrainRenderer&&) noexcept;
    TerrainRenderer& operator=(TerrainRenderer&&) noexcept;
    ~TerrainRenderer();

    /// Draws one frame. A mesh without triangles gives a picture of the sky.
    ///
    /// Fails with invalid_argument for a view that check(view) refuses, whose size is not the
    /// renderer's, or whose eye is more than 2^49 lattice spacings away, and for a mesh whose chunks
    /// are not those of its resident set or whose indices end early; device_unavailable for errors
    /// of OpenGL. Then the last frame stays.
    Result<void> draw(const TerrainMesh& mesh, const View& view,
                      std::span<const DrawnObject> objects = {});

    /// The last frame.
    Image read() const;

    /// Samples a pixel that the device gave.
    int sample_count() const;

    /// Bytes that heights and slopes of chunks take on the device now. They stand in a pool that
    /// doubles when it is full and is given back when it is empty: it may take more.
    std::size_t buffer_bytes() const;

private:
    struct State;
    explicit TerrainRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
