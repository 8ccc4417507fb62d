// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <pybind11/pybind11.h>

#include <utility>

namespace terrane::python {

namespace py = pybind11;

/// Throws the exception that Python sees: ValueError (invalid_argument, bad_data), OSError (io), MemoryError,
/// TimeoutError, RuntimeError (device_unavailable, cancelled), with the error's line. Requires the interpreter lock.
[[noreturn]] void raise_error(const Error& error);

/// The value of a result, or its exception. Requires the interpreter lock.
template <class T>
T value_or_raise(Result<T> result) {
    if (!result) raise_error(result.error());
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// Calls a function without the interpreter lock, so that other threads of Python go on.
template <class Function>
auto without_lock(Function&& function) {
    const py::gil_scoped_release released;
    return std::forward<Function>(function)();
}

}  // namespace terrane::python
