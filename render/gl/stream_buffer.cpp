// SPDX-License-Identifier: MIT
#include "gl/stream_buffer.h"

namespace terrane::internal {

StreamBuffer::~StreamBuffer() {
    for (Turn& turn : turns_) {
        if (turn.fence != nullptr) glDeleteSync(turn.fence);
    }
}

void StreamBuffer::wait(Turn& turn) {
    if (turn.fence == nullptr) return;
    constexpr GLuint64 kOneSecond = 1'000'000'000;
    // also ends where the wait fails: with a lost context no fence is signalled
    while (glClientWaitSync(turn.fence, GL_SYNC_FLUSH_COMMANDS_BIT, kOneSecond) ==
           GL_TIMEOUT_EXPIRED) {
    }
    glDeleteSync(turn.fence);
    turn.fence = nullptr;
}

std::byte* StreamBuffer::begin(std::size_t bytes) {
    turn_ = (turn_ + 1) % turns_.size();
    Turn& turn = turns_[turn_];
    wait(turn);
    if (turn.bytes >= bytes) return turn.memory;
    // 1.5 times the size, so that a slowly growing mesh reallocates rarely
    const std::size_t wanted = bytes + bytes / 2;
    constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    turn.buffer = make_buffer();
    glNamedBufferStorage(turn.buffer.name(), static_cast<GLsizeiptr>(wanted), nullptr, kAccess);
    turn.memory = static_cast<std::byte*>(
        glMapNamedBufferRange(turn.buffer.name(), 0, static_cast<GLsizeiptr>(wanted), kAccess));
    turn.bytes = turn.memory == nullptr ? 0 : wanted;
    return turn.memory;
}

void StreamBuffer::end() { turns_[turn_].fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0); }

}  // namespace terrane::internal
