// SPDX-License-Identifier: MIT
// The extension module terrane._terrane, which terrane/__init__.py imports into the package.
#include "bodies.h"
#include "terrain.h"

#include <pybind11/pybind11.h>

#include <algorithm>
#include <string>
#include <string_view>

namespace {

namespace py = pybind11;

// pybind11's own entry of all functions of the module.
PyCFunctionWithKeywords entry_of_pybind11 = nullptr;

/// "Lidar, int, velocity=str"
std::string types_of(PyObject* arguments, PyObject* keywords) {
    std::string text;
    const auto add = [&text](const std::string& name, py::handle value) {
        text.append(text.empty() ? "" : ", ").append(name).append(Py_TYPE(value.ptr())->tp_name);
    };
    for (const py::handle value : py::reinterpret_borrow<py::tuple>(arguments)) add("", value);
    if (keywords == nullptr) return text;
    for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(keywords))
        add(py::cast<std::string>(name).append("="), value);
    return text;
}

/// Where arguments fit no signature, pybind11's message has a line for each signature, and then the arguments
/// themselves. Returns one line with the signatures and the types of the arguments; "" for another message.
std::string one_line(std::string message, PyObject* arguments, PyObject* keywords) {
    constexpr std::string_view kCall = "(): incompatible ", kFirst = "\n    1. ";
    const std::size_t call = message.find(kCall), first = message.find(kFirst),
                      end = message.find("\n\nInvoked with");
    if (call == std::string::npos || first == std::string::npos || end == std::string::npos)
        return {};
    std::string signatures = message.substr(first + kFirst.size(), end - first - kFirst.size());
    for (int i = 2;; ++i) {
        const std::string next = "\n    " + std::to_string(i) + ". ";
        const std::size_t place = signatures.find(next);
        if (place == std::string::npos) break;
        signatures.replace(place, next.size(), " or ");
    }
    std::replace(signatures.begin(), signatures.end(), '\n', ' ');
    std::string line = call == 0 ? "a property" : message.substr(0, call).append("()");
    line.append(" takes ").append(signatures).append(", got (");
    line.append(types_of(arguments, keywords)).append(")");
    constexpr std::string_view kModule = "terrane._terrane.";  // before names of classes
    for (;;) {
        const std::size_t place = line.find(kModule);
        if (place == std::string::npos) return line;
        line.erase(place, kModule.size());
    }
}

PyObject* call_with_errors_of_one_line(PyObject* self, PyObject* arguments, PyObject* keywords) {
    PyObject* const result = entry_of_pybind11(self, arguments, keywords);
    if (result != nullptr || PyErr_ExceptionMatches(PyExc_TypeError) == 0) return result;
    try {
        py::error_already_set error;
        const std::string line =
            one_line(py::cast<std::string>(py::str(error.value())), arguments, keywords);
        if (line.empty()) {
            error.restore();
        } else {
            PyErr_SetString(PyExc_TypeError, line.c_str());
        }
    } catch (py::error_already_set& error) {
        error.restore();
    }
    return nullptr;
}

void shorten_errors_of(py::handle function) {
    if (!function || !PyCFunction_Check(function.ptr())) return;
    PyMethodDef& definition = *reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
    if (definition.ml_flags != (METH_VARARGS | METH_KEYWORDS)) return;
    const auto entry = reinterpret_cast<void (*)()>(definition.ml_meth);
    const auto own = reinterpret_cast<void (*)()>(&call_with_errors_of_one_line);
    if (entry == own) return;
    entry_of_pybind11 = reinterpret_cast<PyCFunctionWithKeywords>(entry);
    definition.ml_meth = reinterpret_cast<PyCFunction>(own);
}

/// Makes the errors of a module's functions, or of a class's methods and properties, one line each.
void shorten_errors(py::handle module_or_class) {
    for (const auto& [name, value] : py::dict(module_or_class.attr("__dict__"))) {
        if (PyInstanceMethod_Check(value.ptr())) {
            shorten_errors_of(PyInstanceMethod_Function(value.ptr()));
        } else if (py::isinstance<py::staticmethod>(value)) {
            shorten_errors_of(value.attr("__func__"));
        } else if (PyObject_TypeCheck(value.ptr(), &PyProperty_Type)) {
            for (const char* part : {"fget", "fset"}) {
                const py::object accessor = value.attr(part);
                shorten_errors_of(PyInstanceMethod_Check(accessor.ptr())
                                      ? PyInstanceMethod_Function(accessor.ptr())
                                      : accessor.ptr());
            }
        } else if (PyType_Check(value.ptr()) && py::isinstance<py::module_>(module_or_class)) {
            shorten_errors(value);
        } else {
            shorten_errors_of(value);
        }
    }
}

}  // namespace

PYBIND11_MODULE(_terrane, module) {
    namespace python = terrane::python;
    module.doc() = "Terrane's C++ library. Import terrane instead.";
    module.attr("__version__") = TERRANE_PYTHON_VERSION;
    python::bind_sources(module);
    python::bind_views(module);
    python::bind_resident(module);
    python::bind_ground(module);
    python::bind_batches(module);
    python::bind_meshes(module);
    python::bind_terrain(module);
    python::bind_shapes(module);
    python::bind_ground_queries(module);
    python::bind_pairs(module);
    python::bind_world(module);
    python::bind_vehicles(module);
    python::bind_lidar(module);
    pybind11::list components;
    for (const char* name : {"terrain", "collision"}) components.append(name);
    if (TERRANE_PYTHON_STORE) components.append("store");
    if (TERRANE_PYTHON_REMOTE) components.append("remote");
    if (TERRANE_PYTHON_DEM) components.append("dem");
#if TERRANE_PYTHON_RENDER
    python::bind_pictures(module);
    components.append("render");
#endif
    module.attr("components") = pybind11::tuple(components);
    shorten_errors(module);
}
