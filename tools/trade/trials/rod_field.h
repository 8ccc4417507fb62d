// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/view_volume.h>
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
    boxes,        ///< the same of oriented boxes
    exact_boxes,  ///< and ViewVolume::meets()
    triangles,    ///< and ViewVolume::meets_triangles()
};

/// The tests in their order, and their names.
inline constexpr std::array kCullTests{CullTest::none, CullTest::spheres, CullTest::boxes,
                                       CullTest::exact_boxes, CullTest::triangles};
const char* name_of(CullTest test);

/// What a frame costs.
struct FieldFrame {
    std::size_t kept = 0;
    double cull_ms = 0.0;
    double draw_ms = 0.0;  ///< until the picture can be read; NaN without a device
};

/// Copies of a mesh at random poses around an eye, and a device that draws them where one opens.
class RodField {
public:
    /// @param box      of the mesh
    /// @param far_away largest distance of a copy from the eye, metres
    /// @param is_quick no software rasteriser draws
    RodField(TriangleMesh mesh, const Aabb& box, std::size_t count, double far_away, bool is_quick);

    /// Tests all copies and draws what is kept.
    Result<FieldFrame> make_frame(CullTest test) const;

private:
    struct Device {
        EglContext context;  // the renderer's objects live in it
        TerrainRenderer renderer;
        MeshId mesh;
    };
    bool is_kept(CullTest test, const ViewVolume& volume, std::size_t copy) const;
    void open_device(bool is_quick);

    TriangleMesh mesh_;
    View view_;
    std::vector<Pose> poses_;
    std::vector<OrientedBox> boxes_;
    std::vector<BoundingSphere> balls_;
    std::unique_ptr<Device> device_;  // null: none opens
};

}  // namespace terrane::tools
