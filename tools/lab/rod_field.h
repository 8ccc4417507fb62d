// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/culling.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace terrane::tools {

/// Culling tests, from none to exact.
enum class CullTest {
    none,
    spheres,      ///< ViewVolume::test_planes() of bounding spheres
    boxes,        ///< the same for oriented boxes
    exact_boxes,  ///< also ViewVolume::meets()
    triangles,    ///< also ViewVolume::meets_triangles()
};

/// The tests in order, and their names.
inline constexpr std::array kCullTests{CullTest::none, CullTest::spheres, CullTest::boxes,
                                       CullTest::exact_boxes, CullTest::triangles};
const char* name_of(CullTest test);

/// A rod of 20 x 2 x 2 m about its x axis, with pointed ends.
TriangleMesh make_rod_mesh(int triangles);

/// Cost of a frame.
struct FieldFrame {
    std::size_t kept = 0;
    double cull_ms = 0.0;
    double draw_ms = 0.0;  ///< until the picture can be read; NaN without a device
};

/// Copies of a mesh at random poses around the origin, and a device that draws them, if one can be opened.
class RodField {
public:
    /// @param box      bounding box of the mesh
    /// @param far_away largest distance of a copy from the origin, metres
    /// @param is_quick whether to skip drawing on software rasterisers
    RodField(TriangleMesh mesh, const Aabb& box, std::size_t count, double far_away, bool is_quick);

    /// The view of a frame: from the origin, 640 x 360 pixels.
    static View usual_view();

    /// Tests all copies and draws those not culled.
    ///
    /// @param view a view with the picture size of usual_view()
    Result<FieldFrame> make_frame(CullTest test, const View& view = usual_view()) const;

private:
    struct Device {
        GlContext context;  // the renderer's objects live in it
        TerrainRenderer renderer;
        MeshId mesh;
    };
    bool is_kept(CullTest test, const ViewVolume& volume, std::size_t copy) const;

    TriangleMesh mesh_;
    std::vector<Pose> poses_;
    std::vector<OrientedBox> boxes_;
    std::vector<BoundingSphere> balls_;
    std::unique_ptr<Device> device_;  // null if none can be opened
};

}  // namespace terrane::tools
