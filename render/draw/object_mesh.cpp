// SPDX-License-Identifier: MIT
#include "draw/object_mesh.h"

#include <cmath>
#include <numbers>
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

/// A point of the profile of a surface of revolution about z, and its normal.
struct Outline {
    double radius, z;
    double normal_out, normal_up;
};

/// Surface of revolution of a profile, given from bottom to top, about z.
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

ObjectMesh make_ball() {
    constexpr int kParallels = 16;
    return make_round(kParallels, [](int parallel) {
        const double latitude =
            std::numbers::pi * (static_cast<double>(parallel) / kParallels - 0.5);
        // on the unit sphere the normal is the position
        const double run = std::cos(latitude), rise = std::sin(latitude);
        return Outline{run, rise, run, rise};
    });
}

ObjectMesh make_tube() {
    return make_round(1, [](int end) { return Outline{1.0, end == 0 ? -1.0 : 1.0, 1.0, 0.0}; });
}

}  // namespace terrane::internal
