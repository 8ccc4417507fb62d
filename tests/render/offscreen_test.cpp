// SPDX-License-Identifier: MIT
#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "render/render_scene.h"
#include "support/random.h"

#include <terrane/render/offscreen.h>

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <vector>

namespace terrane {
namespace egl_context_test {

TEST(GlContext, OpensOpenGl45CoreOrSaysWhyNot) {
    Result<GlContext> context = GlContext::create();
    if (!context) {
        EXPECT_EQ(context.error().code, ErrorCode::device_unavailable);
        EXPECT_NE(context.error().message, "");
        GTEST_SKIP() << context.error().message;
    }
    EXPECT_GE(epoxy_gl_version(), 45);
    EXPECT_NE(context->renderer_name(), "");
}

using EglContextTest = test::GlTest;

TEST_F(EglContextTest, TwoLiveSideBySideAndTakeTurns) {
    {
        Result<GlContext> second = GlContext::create();
        ASSERT_TRUE(second) << second.error().message;
        context_->make_current();
        second->make_current();
    }
    context_->make_current();
    EXPECT_NE(glGetString(GL_RENDERER), nullptr);
}

TEST_F(EglContextTest, WithChecksAGlErrorIsAFailedResultOnce) {
    EXPECT_TRUE(internal::check_gl("start"));
    glEnable(GL_TRIANGLES);  // an error: not a capability
    const Result<void> bad = internal::check_gl("try");
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().code, ErrorCode::device_unavailable);
    EXPECT_NE(bad.error().message.find("GL_INVALID_ENUM"), std::string::npos)
        << bad.error().message;
    EXPECT_TRUE(internal::check_gl("go on"));
}

}  // namespace egl_context_test
}  // namespace terrane

namespace terrane::internal {
namespace gpu_timer_test {

using GpuTimerTest = test::GlTest;

TEST_F(GpuTimerTest, ReportsATimeOnceTheDeviceHasFinishedAFrame) {
    GpuTimer timer;
    EXPECT_FALSE(timer.last_ms());
    for (int frame = 0; frame < 8; ++frame) {
        timer.begin();
        timer.end();
        glFinish();
    }
    ASSERT_TRUE(timer.last_ms());
    EXPECT_GE(*timer.last_ms(), 0.0);
    const Result<void> good = check_gl("time frames");
    EXPECT_TRUE(good) << good.error().message;
}

}  // namespace gpu_timer_test

namespace stream_buffer_test {

using StreamBufferTest = test::GlTest;

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

namespace terrane {
namespace image_test {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
    const fs::path folder = fs::path(TERRANE_BUILD_DIR) / "test_images";
    fs::create_directories(folder);
    return folder / name;
}

Image make_noise(int width, int height) {
    test::Random random(5);
    Image image;
    image.width = width;
    image.height = height;
    for (int i = 0; i < width * height * 3; ++i) {
        image.rgb.push_back(static_cast<std::uint8_t>(random.below(256)));
    }
    return image;
}

TEST(Png, ReadsBackEveryByteThatItWrote) {
    for (const auto& [width, height] : {std::pair{1, 1}, std::pair{7, 3}, std::pair{640, 361}}) {
        const Image image = make_noise(width, height);
        const std::string path = scratch("round_trip.png").string();
        const Result<void> written = write_png(image, path);
        ASSERT_TRUE(written) << written.error().message;
        const Result<Image> read = read_png(path);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(read->width, width);
        EXPECT_EQ(read->height, height);
        EXPECT_EQ(read->rgb, image.rgb);
    }
}

TEST(Png, ReplacesAFileAndLeavesNothingBesideIt) {
    const fs::path path = scratch("replaced.png");
    ASSERT_TRUE(write_png(make_noise(9, 9), path.string()));
    ASSERT_TRUE(write_png(make_noise(4, 5), path.string()));
    EXPECT_EQ(read_png(path.string())->width, 4);
    EXPECT_FALSE(fs::exists(path.string() + ".part"));
}

TEST(Png, AnUnwritablePathIsAnErrorThatNamesItAndLeavesNothingBesideIt) {
    fs::create_directories(scratch("folder.png") / "inside");
    for (const char* name : {"no_such_folder/picture.png", "folder.png"}) {
        const std::string path = scratch(name).string();
        const Result<void> written = write_png(make_noise(2, 2), path);
        ASSERT_FALSE(written);
        EXPECT_EQ(written.error().code, ErrorCode::io);
        EXPECT_NE(written.error().message.find(path), std::string::npos) << written.error().message;
        EXPECT_FALSE(fs::exists(path + ".part"));
    }
}

TEST(Png, APictureWithoutPixelsOrWithTooFewBytesIsRefused) {
    const std::string path = scratch("none.png").string();
    Image torn = make_noise(4, 4);
    torn.rgb.pop_back();
    for (const Image& image : {Image{}, torn}) {
        const Result<void> written = write_png(image, path);
        ASSERT_FALSE(written);
        EXPECT_EQ(written.error().code, ErrorCode::invalid_argument);
    }
    EXPECT_FALSE(fs::exists(path));
}

TEST(Png, AMissingATextAndATornFileAreErrorsThatNameThem) {
    const std::string text = scratch("text.png").string();
    std::ofstream(text) << "not a picture at all\n";
    const std::string torn = scratch("torn.png").string();
    ASSERT_TRUE(write_png(make_noise(64, 64), torn));
    fs::resize_file(torn, fs::file_size(torn) / 2);
    for (const std::string& path : {scratch("missing.png").string(), text, torn}) {
        const Result<Image> read = read_png(path);
        ASSERT_FALSE(read) << path;
        EXPECT_EQ(read.error().code, ErrorCode::io);
        EXPECT_NE(read.error().message.find(path), std::string::npos) << read.error().message;
    }
}

}  // namespace image_test
}  // namespace terrane
