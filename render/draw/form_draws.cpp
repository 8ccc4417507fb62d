// SPDX-License-Identifier: MIT
#include "draw/form_draws.h"

#include "gl/shader.h"

#include <utility>

namespace terrane::internal {

Result<FormDraws::Program> FormDraws::make_program(const std::string& name,
                                                   const std::string& fragment) {
    Result<GlProgram> made = internal::make_program(name, object_vert, fragment);
    if (!made) return tl::unexpected(made.error());
    Program program;
    program.axes = glGetUniformLocation(made->name(), "axes");
    program.extents = glGetUniformLocation(made->name(), "extents");
    program.centre = glGetUniformLocation(made->name(), "centre");
    program.colour = glGetUniformLocation(made->name(), "colour");
    program.program = std::move(*made);
    return program;
}

Result<FormDraws> FormDraws::create(const std::string& lighting, bool has_shadows) {
    FormDraws made;
    Result<Program> lit = make_program("objects", lighting + std::string(object_frag));
    if (!lit) return tl::unexpected(lit.error());
    made.lit_ = *std::move(lit);
    if (has_shadows) {
        Result<Program> depths = make_program("objects' shadows", std::string(depth_frag));
        if (!depths) return tl::unexpected(depths.error());
        made.depths_ = *std::move(depths);
    }
    made.cube_ = make_cube();
    made.ball_ = make_ball();
    made.tube_ = make_tube();
    made.layout_ = make_vertex_array();
    const GLuint layout = made.layout_.name();
    for (GLuint attribute = 0; attribute < 2; ++attribute) {
        glEnableVertexArrayAttrib(layout, attribute);
        glVertexArrayAttribFormat(layout, attribute, 3, GL_FLOAT, GL_FALSE,
                                  attribute * 3 * sizeof(float));
        glVertexArrayAttribBinding(layout, attribute, 0);
    }
    return made;
}

template <class IsDrawn>
void FormDraws::draw(const Program& program, const View& view, std::span<const DrawnObject> objects,
                     const IsDrawn& is_drawn) const {
    if (objects.empty()) return;
    glUseProgram(program.program.name());
    glBindVertexArray(layout_.name());
    const auto draw_all = [&](DrawnObject::Form form, const ObjectMesh& mesh) {
        glVertexArrayVertexBuffer(layout_.name(), 0, mesh.vertices.name(), 0, 6 * sizeof(float));
        glVertexArrayElementBuffer(layout_.name(), mesh.indices.name());
        for (const DrawnObject& object : objects) {
            if (object.form != form || !is_drawn(object)) continue;
            const Eigen::Matrix3f axes = object.world_from_object.rotation.cast<float>();
            const Eigen::Vector3f size = object.extents.cast<float>();
            const LocalVec centre = to_local(object.world_from_object.translation, view.eye_world);
            const Colour& colour = object.colour;
            glUniformMatrix3fv(program.axes, 1, GL_FALSE, axes.data());
            glUniform3f(program.extents, size.x(), size.y(), size.z());
            glUniform3f(program.centre, centre.x(), centre.y(), centre.z());
            glUniform3f(program.colour, colour.red, colour.green, colour.blue);
            glDrawElements(GL_TRIANGLES, mesh.index_count, GL_UNSIGNED_SHORT, nullptr);
        }
    };
    draw_all(DrawnObject::Form::box, cube_);
    draw_all(DrawnObject::Form::ball, ball_);
    draw_all(DrawnObject::Form::tube, tube_);
}

void FormDraws::draw(const View& view, std::span<const DrawnObject> objects) const {
    draw(lit_, view, objects, [](const DrawnObject&) { return true; });
}

void FormDraws::draw_casters(const SunCascade& cascade, const View& view,
                             std::span<const DrawnObject> objects) const {
    draw(depths_, view, objects, [&](const DrawnObject& object) {
        return cascade.meets(
            BoundingSphere{object.world_from_object.translation, object.extents.norm()});
    });
}

}  // namespace terrane::internal
