// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "light/shadow_maps.h"

#include <terrane/render/terrain_renderer.h>

#include <cstdint>
#include <span>
#include <string>

namespace terrane::internal {

/// A small mesh on the device: positions and unit normals, 6 floats a vertex.
struct ObjectMesh {
    GlBuffer vertices;
    GlBuffer indices;  ///< 16 bits
    std::int32_t index_count = 0;
};

/// A cube from -1 to 1 along each axis.
ObjectMesh make_cube();
/// A sphere of radius 1 around the origin.
ObjectMesh make_unit_sphere();
/// An open cylinder of radius 1 about z, from z = -1 to 1.
ObjectMesh make_unit_cylinder();

/// Draws DrawnObjects: boxes, ellipsoids and cylinders.
class FormDraws {
public:
    /// @param lighting    text prepended to object.frag: defines lit_at() and shown_at()
    /// @param has_shadows whether draw_casters() is called
    ///
    /// Fails: device_unavailable if its shaders do not compile
    static Result<FormDraws> create(const std::string& lighting, bool has_shadows);

    void draw(const View& view, std::span<const DrawnObject> objects) const;
    /// Draws into a shadow map the objects that can cast a shadow into it.
    void draw_casters(const SunCascade& cascade, const View& view,
                      std::span<const DrawnObject> objects) const;

private:
    struct Program {
        GlProgram program;
        GLint axes = -1, extents = -1, centre = -1, colour = -1;
    };
    FormDraws() = default;
    static Result<Program> make_program(const std::string& name, const std::string& fragment);
    template <class IsDrawn>
    void draw(const Program& program, const View& view, std::span<const DrawnObject> objects,
              const IsDrawn& is_drawn) const;

    Program lit_, depths_;
    GlVertexArray layout_;
    ObjectMesh cube_, ellipsoid_, cylinder_;
};

}  // namespace terrane::internal
