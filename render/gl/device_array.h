// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/base/result.h>

#include <cstddef>
#include <vector>

namespace terrane::internal {

/// A storage block that grows.
class DeviceArray {
public:
    GLuint name() const { return buffer_.name(); }
    std::size_t bytes() const { return bytes_; }

    /// Makes room, with a share for later growth. Fails with device_unavailable if the device has no block of the size.
    ///
    /// @param keeps whether the content is kept
    Result<void> reserve(std::size_t wanted, bool keeps);
    void write(std::size_t first_byte, const void* from, std::size_t count) const {
        glNamedBufferSubData(name(), static_cast<GLintptr>(first_byte),
                             static_cast<GLsizeiptr>(count), from);
    }
    /// Values from a place on, counted in values. Waits for the device.
    template <typename Value>
    std::vector<Value> read(std::size_t first, std::size_t count) const {
        std::vector<Value> values(count);
        glGetNamedBufferSubData(name(), static_cast<GLintptr>(first * sizeof(Value)),
                                static_cast<GLsizeiptr>(count * sizeof(Value)), values.data());
        return values;
    }

private:
    GlBuffer buffer_;
    std::size_t bytes_ = 0;
};

}  // namespace terrane::internal
