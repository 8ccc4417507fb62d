// SPDX-License-Identifier: MIT
#include "ground/pager.h"
#include "values/arrays.h"
#include "values/errors.h"

namespace terrane::python {

void bind_views(py::module_& module) {
    py::class_<View>(module, "View", "What a camera sees. Immutable: look_at() makes one.")
        .def_property_readonly(
            "eye_world", [](const View& view) { return to_array(view.eye_world); },
            "The viewpoint: shape (3,), world, metres.")
        .def_property_readonly(
            "forward", [](const View& view) { return to_array(view.forward); },
            "Unit direction of view: shape (3,), world axes.")
        .def_property_readonly(
            "up", [](const View& view) { return to_array(view.up); },
            "Unit vector, square to forward: shape (3,), world axes.")
        .def_readonly("vertical_fov", &View::vertical_fov,
                      "Angle that the picture's height spans, radians.")
        .def_readonly("width_px", &View::width_px, "Width of the picture, pixels.")
        .def_readonly("height_px", &View::height_px, "Height of the picture, pixels.")
        .def_readonly("near_distance", &View::near_distance,
                      "Least distance in screen errors, metres.")
        .def_property_readonly("pixels_per_radian", &View::pixels_per_radian,
                               "Pixels of the picture's centre that one radian spans.");
    const View defaults;
    module.def(
        "look_at",
        [](const py::object& eye, const py::object& target, double vertical_fov, int width_px,
           int height_px, double near_distance) {
            View view = value_or_raise(look_at(read_vector(eye, "eye_world"),
                                               read_vector(target, "target_world"), vertical_fov,
                                               width_px, height_px));
            view.near_distance = near_distance;
            value_or_raise(check(view));
            return view;
        },
        py::arg("eye_world"), py::arg("target_world"),
        py::arg("vertical_fov") = defaults.vertical_fov, py::arg("width_px") = defaults.width_px,
        py::arg("height_px") = defaults.height_px,
        py::arg("near_distance") = defaults.near_distance,
        R"(The View from a point to another; up is north for vertical directions.

eye_world, target_world  shape (3,), metres
vertical_fov             radians, between 0 and pi
near_distance            least distance in screen errors, metres

Raises ValueError where they coincide or a value is out of range or not finite.)");
}

}  // namespace terrane::python
