// SPDX-License-Identifier: MIT
#include "gl/device_array.h"

#include <algorithm>
#include <string>
#include <utility>

namespace terrane::internal {

Result<void> DeviceArray::reserve(std::size_t wanted, bool keeps) {
    if (wanted <= bytes_) return {};
    GLint64 most = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most);
    const auto limit = static_cast<std::size_t>(std::max<GLint64>(most, 0));
    if (wanted > limit) {
        return fail(ErrorCode::device_unavailable,
                    "a storage block of " + std::to_string(wanted) +
                        " bytes is needed, and the device has at most " + std::to_string(limit));
    }
    const std::size_t grown = std::min(std::max(wanted, bytes_ + bytes_ / 2), limit);
    GlBuffer made = make_buffer();
    glNamedBufferStorage(made.name(), static_cast<GLsizeiptr>(grown), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    TERRANE_TRY(check_gl("take " + std::to_string(grown) + " bytes of the device"));
    if (keeps && bytes_ > 0) {
        glCopyNamedBufferSubData(name(), made.name(), 0, 0, static_cast<GLsizeiptr>(bytes_));
    }
    buffer_ = std::move(made);
    bytes_ = grown;
    return {};
}

}  // namespace terrane::internal
