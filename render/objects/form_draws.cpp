// SPDX-License-Identifier: MIT
#include "objects/form_draws.h"

#include "gl/shader.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace {

ObjectMesh upload(const std::vector<float>& vertices, const std::vector<std::uint16_t>& indices) {
    ObjectMesh mesh;
    mesh.vertices = make_buffer();
    mesh.indices = make_buffer();
    mesh.index_count = static_cast<std::int32_t>(indices.size());
    glNamedBufferStorage(mesh.vertices.name(),
                         static_cast<GLsizeiptr>(vertices.size() * sizeof(float)), vertices.data(),
                         0);
    glNamedBufferStorage(mesh.indices.name(),
                         static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint16_t)),
                         indices.data(), 0);
    return mesh;
}

/// A point on the profile of a surface of revolution about z, and the normal there.
struct Outline {
    double radius, z;
    double normal_out, normal_up;
};

/// The surface of revolution about z whose profile is outline(step), from bottom to top.
template <class Line>
ObjectMesh make_round(int step_count, const Line& outline) {
    constexpr int kMeridians = 32;
    std::vector<float> vertices;
    std::vector<std::uint16_t> indices;
    for (int step = 0; step <= step_count; ++step) {
        const Outline at = outline(step);
        for (int meridian = 0; meridian <= kMeridians; ++meridian) {
            const double longitude = 2.0 * std::numbers::pi * meridian / kMeridians;
            const double x = std::cos(longitude), y = std::sin(longitude);
            for (const double value : {at.radius * x, at.radius * y, at.z, at.normal_out * x,
                                       at.normal_out * y, at.normal_up}) {
                vertices.push_back(static_cast<float>(value));
            }
        }
    }
    for (int step = 0; step < step_count; ++step) {
        for (int meridian = 0; meridian < kMeridians; ++meridian) {
            const int south_west = step * (kMeridians + 1) + meridian;
            const int north_west = south_west + kMeridians + 1;
            for (const int i : {south_west, south_west + 1, north_west + 1, south_west,
                                north_west + 1, north_west}) {
                indices.push_back(static_cast<std::uint16_t>(i));
            }
        }
    }
    return upload(vertices, indices);
}

}  // namespace

ObjectMesh make_cube() {
    std::vector<float> vertices;
    std::vector<std::uint16_t> indices;
    for (int axis = 0; axis < 3; ++axis) {
        for (const int side : {-1, 1}) {
            const auto first = static_cast<std::uint16_t>(vertices.size() / 6);
            for (int corner = 0; corner < 4; ++corner) {
                int position[3];
                position[axis] = side;
                position[(axis + 1) % 3] = (corner & 1) != 0 ? 1 : -1;
                position[(axis + 2) % 3] = (corner & 2) != 0 ? side : -side;
                for (const int p : position) vertices.push_back(static_cast<float>(p));
                for (int i = 0; i < 3; ++i) {
                    vertices.push_back(i == axis ? static_cast<float>(side) : 0.0f);
                }
            }
            for (const int i : {0, 1, 3, 0, 3, 2}) {
                indices.push_back(static_cast<std::uint16_t>(first + i));
            }
        }
    }
    return upload(vertices, indices);
}

ObjectMesh make_unit_sphere() {
    constexpr int kParallels = 16;
    return make_round(kParallels, [](int parallel) {
        const double latitude =
            std::numbers::pi * (static_cast<double>(parallel) / kParallels - 0.5);
        // on the unit sphere the normal is the position
        const double run = std::cos(latitude), rise = std::sin(latitude);
        return Outline{run, rise, run, rise};
    });
}

ObjectMesh make_unit_cylinder() {
    return make_round(1, [](int end) { return Outline{1.0, end == 0 ? -1.0 : 1.0, 1.0, 0.0}; });
}

Result<FormDraws::Program> FormDraws::make_program(const std::string& name,
                                                   const std::string& fragment) {
    TERRANE_TRY(GlProgram made, internal::make_program(name, object_vert, fragment));
    Program program;
    program.axes = glGetUniformLocation(made.name(), "axes");
    program.extents = glGetUniformLocation(made.name(), "extents");
    program.centre = glGetUniformLocation(made.name(), "centre");
    program.colour = glGetUniformLocation(made.name(), "colour");
    program.program = std::move(made);
    return program;
}

Result<FormDraws> FormDraws::create(const std::string& lighting, bool has_shadows) {
    FormDraws made;
    TERRANE_TRY(Program lit, make_program("objects", lighting + std::string(object_frag)));
    made.lit_ = std::move(lit);
    if (has_shadows) {
        TERRANE_TRY(Program depths, make_program("objects' shadows", std::string(depth_frag)));
        made.depths_ = std::move(depths);
    }
    made.cube_ = make_cube();
    made.ellipsoid_ = make_unit_sphere();
    made.cylinder_ = make_unit_cylinder();
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
    draw_all(DrawnObject::Form::ellipsoid, ellipsoid_);
    draw_all(DrawnObject::Form::cylinder, cylinder_);
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
