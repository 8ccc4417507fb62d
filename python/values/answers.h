// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

#include <array>
#include <string>
#include <string_view>
#include <utility>

namespace terrane::python {

namespace py = pybind11;

/// An answer: a named tuple or an enumerator of terrane/answers.py.
template <class... Fields>
py::object make_answer(const char* type, Fields&&... fields) {
    return py::module_::import("terrane.answers").attr(type)(std::forward<Fields>(fields)...);
}

/// The value whose name an argument gives, such as kind="ridged".
/// Fails: ValueError that lists the names
template <class Enum, std::size_t count>
Enum read_choice(std::string_view argument, const char* name,
                 const std::array<std::pair<const char*, Enum>, count>& choices) {
    std::string known;
    for (const auto& [word, value] : choices) {
        if (argument == word) return value;
        known += (known.empty() ? "" : ", ") + std::string(word);
    }
    throw py::value_error(std::string(name) + " must be one of " + known + ", got \"" +
                          std::string(argument) + "\"");
}

}  // namespace terrane::python
