// SPDX-License-Identifier: MIT
#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "render/gl_test.h"

#include <terrane/render/offscreen.h>

#include <gtest/gtest.h>

#include <cstring>
#include <set>
#include <vector>

namespace terrane::internal {
namespace stream_buffer_test {

class StreamBufferTest : public test::GlTest {};

TEST_F(StreamBufferTest, WhatAFrameReadsIsNotOverwrittenByTheNextOnes) {
    constexpr std::size_t kCount = 100'000;
    constexpr int kFrames = 9;
    constexpr GLsizeiptr kBytes = GLsizeiptr{kCount * sizeof(int)};
    StreamBuffer stream;
    const GlBuffer copies = make_buffer();
    glNamedBufferStorage(copies.name(), kFrames * kBytes, nullptr, 0);
    for (int frame = 0; frame < kFrames; ++frame) {
        std::byte* memory = stream.begin(kCount * sizeof(int));
        ASSERT_NE(memory, nullptr);
        const std::vector<int> values(kCount, frame + 1);
        std::memcpy(memory, values.data(), values.size() * sizeof(int));
        glCopyNamedBufferSubData(stream.name(), copies.name(), 0, frame * kBytes, kBytes);
        stream.end();
    }
    std::vector<int> read(kFrames * kCount);
    glGetNamedBufferSubData(copies.name(), 0, kFrames * kBytes, read.data());
    for (std::size_t i = 0; i < read.size(); ++i) {
        ASSERT_EQ(read[i], static_cast<int>(i / kCount) + 1) << i;
    }
    EXPECT_TRUE(check_gl("stream"));
}

TEST_F(StreamBufferTest, TakesTurnsAndGrowsOnlyWhereAFrameNeedsMore) {
    StreamBuffer stream;
    std::set<const std::byte*> seen;
    for (int frame = 0; frame < 12; ++frame) {
        // fits into three buffers of 1.5 * 1000 bytes
        std::byte* memory = stream.begin(1000 + 40 * static_cast<std::size_t>(frame));
        ASSERT_NE(memory, nullptr);
        seen.insert(memory);
        stream.end();
    }
    EXPECT_EQ(seen.size(), 3u);
    std::byte* memory = stream.begin(1'000'000);
    ASSERT_NE(memory, nullptr);
    std::memset(memory, 1, 1'000'000);
    EXPECT_EQ(seen.count(memory), 0u);
    stream.end();
    EXPECT_TRUE(check_gl("stream"));
}

}  // namespace stream_buffer_test
}  // namespace terrane::internal
