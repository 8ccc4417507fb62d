// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

namespace terrane::tools {

struct ViewFacts;

/// A square of the ground from above, shaded from the north-west and coloured by height.
struct MapPicture {
    static constexpr int kTexels = 128;  ///< along a side
    WorldVec2 centre_world = WorldVec2::Zero();
    double side = 0.0;             ///< metres
    double low = 0.0, high = 0.0;  ///< heights of the first and the last tint; low > high: none
    /// [kTexels^2] red, green, blue and opacity, row by row from the north-west; opacity 0 where nothing is resident.
    std::vector<std::array<std::uint8_t, 4>> texels = {};
};

/// Draws what is resident. Relief is exaggerated if it is low.
///
/// Cost: about 1 ms
MapPicture make_map_picture(const ResidentSet& resident, const WorldVec2& centre_world,
                            double side);

/// The contents of the map: ground, chunks, path, bodies and the view, with the eye in the middle.
class MapPanel {
public:
    /// Reserves room for the picture of the ground in ImGui's texture. Call once, before the first frame.
    void reserve_texture();
    /// Makes the picture of the ground anew if it is old, once a second at most. Call while the map is shown, between
    /// NewFrame() of the backend and that of ImGui.
    void refresh(const ViewFacts& facts);
    /// Draws into the current window of ImGui.
    ///
    /// @param side_units of the map, ImGui's units
    void draw(const ViewFacts& facts, float side_units);

private:
    class Frame;
    void draw_ground(const Frame& frame) const;

    double side_ = 4000.0;  // metres
    int texture_ = 0;       // of ImGui's custom rectangles
    std::optional<MapPicture> picture_;
    std::uint64_t epoch_ = 0;  // of the set that picture_ shows
    std::chrono::steady_clock::time_point made_;
};

}  // namespace terrane::tools
