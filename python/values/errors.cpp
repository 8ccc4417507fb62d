// SPDX-License-Identifier: MIT
#include "values/errors.h"

namespace terrane::python {
namespace {

PyObject* exception_of(ErrorCode code) {
    switch (code) {
        case ErrorCode::invalid_argument:
        case ErrorCode::bad_data:
            return PyExc_ValueError;
        case ErrorCode::io:
            return PyExc_OSError;
        case ErrorCode::out_of_memory:
            return PyExc_MemoryError;
        case ErrorCode::timed_out:
            return PyExc_TimeoutError;
        case ErrorCode::device_unavailable:
        case ErrorCode::cancelled:
            break;
    }
    return PyExc_RuntimeError;
}

}  // namespace

void raise_error(const Error& error) {
    PyErr_SetString(exception_of(error.code), error.message.c_str());
    throw py::error_already_set();
}

}  // namespace terrane::python
