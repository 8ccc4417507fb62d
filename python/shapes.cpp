// SPDX-License-Identifier: MIT
#include "bodies.h"
#include "conversions.h"

#include <pybind11/stl.h>

#include <array>
#include <string>
#include <vector>

namespace terrane::python {
namespace {

HeldShape checked(Shape shape) {
    value_or_raise(validate(shape));
    return {std::move(shape)};
}

HeldShape make_hull(const py::object& argument) {
    const std::vector<Eigen::Vector3d> points = read_points(argument, "points");
    return {value_or_raise(without_lock([&] { return ConvexHull::create(points); }))};
}

HeldShape make_compound(
    const std::vector<std::tuple<HeldShape, py::object, py::object>>& arguments) {
    std::vector<CompoundPart> parts;
    for (const auto& [held, position, rotation] : arguments) {
        const auto append = [&, &place = position, &turn = rotation](const auto& shape) {
            if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, Compound>) {
                throw py::value_error("parts[" + std::to_string(parts.size()) +
                                      "] is a compound: a part must be convex");
            } else {
                parts.push_back({shape, read_pose(place, turn)});
            }
        };
        std::visit(append, held.shape);
    }
    return {value_or_raise(without_lock([&] { return Compound::create(parts); }))};
}

HeldShape make_from_triangles(const py::object& vertices, const py::object& triangles) {
    const std::vector<Eigen::Vector3d> points = read_points(vertices, "vertices");
    const std::vector<std::array<std::uint32_t, 3>> faces =
        read_triangles(triangles, "triangles", points.size());
    return {value_or_raise(without_lock([&] { return Compound::from_triangles(points, faces); }))};
}

const char* kind_of(const HeldShape& held) {
    static constexpr std::array<const char*, 5> kKinds{"sphere", "capsule", "box", "hull",
                                                       "compound"};
    static_assert(std::variant_size_v<Shape> == kKinds.size());
    return kKinds.at(held.shape.index());
}

py::object vertices_of(const HeldShape& held) {
    const auto* hull = std::get_if<ConvexHull>(&held.shape);
    if (hull == nullptr) throw py::type_error("only a hull has vertices");
    const auto vertices = hull->vertices();
    py::array_t<double> array({static_cast<py::ssize_t>(vertices.size()), py::ssize_t{3}});
    double* out = array.mutable_data();
    for (const Eigen::Vector3d& vertex : vertices) {
        write_vector(vertex, out);
        out += 3;
    }
    return array;
}

}  // namespace

void bind_shapes(py::module_& module) {
    py::class_<HeldShape>(module, "Shape",
                          "A convex shape, or a compound of them, in its own frame. Immutable. "
                          "ValueError for a size out of range.")
        .def_static(
            "sphere", [](double radius) { return checked(Sphere{radius}); }, py::arg("radius"),
            "A sphere around the origin; metres.")
        .def_static(
            "capsule",
            [](double radius, double half_height) {
                return checked(Capsule{radius, half_height});
            },
            py::arg("radius"), py::arg("half_height"),
            "Everything within `radius` of the segment from z = -half_height to half_height; "
            "metres.")
        .def_static(
            "box",
            [](const py::object& half_extents) {
                return checked(Box{read_vector(half_extents, "half_extents")});
            },
            py::arg("half_extents"),
            "A box around the origin, along the axes: half extents of shape (3,), metres.")
        .def_static("hull", &make_hull, py::arg("points"),
                    "The convex hull of points of shape (n, 3), metres. Without the lock.")
        .def_static("compound", &make_compound, py::arg("parts"),
                    "The union of convex shapes: a list of (shape, position, rotation); the "
                    "rotation as in queries, or None.")
        .def_static(
            "from_triangles", &make_from_triangles, py::arg("vertices"), py::arg("triangles"),
            R"(The surface of a triangle mesh as a compound of flat parts, without an inside.

vertices   shape (n, 3), metres
triangles  indices of vertices, shape (m, 3), at most 100,000)")
        .def_property_readonly("kind", &kind_of,
                               "\"sphere\", \"capsule\", \"box\", \"hull\" or \"compound\".")
        .def_property_readonly(
            "bounding_radius", [](const HeldShape& held) { return bounding_radius(held.shape); },
            "Largest distance of a point from the origin, metres.")
        .def_property_readonly(
            "smallest_half_extent",
            [](const HeldShape& held) { return smallest_half_extent(held.shape); },
            "Half of the extent along its thinnest direction, metres.")
        .def_property_readonly(
            "contact_tolerance",
            [](const HeldShape& held) { return default_contact_tolerance(held.shape); },
            "Default tolerance of a body of this shape, metres.")
        .def_property_readonly("vertices", &vertices_of,
                               "Of a hull: float64 of shape (n, 3), metres; else TypeError.")
        .def("__repr__", [](const HeldShape& held) {
            return "<terrane.Shape " + std::string(kind_of(held)) + ">";
        });
}

}  // namespace terrane::python
