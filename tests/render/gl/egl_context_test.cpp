// SPDX-License-Identifier: MIT
#include "gl/gl_object.h"

#include <terrane/render/offscreen.h>

#include <epoxy/gl.h>
#include <gtest/gtest.h>

namespace terrane {
namespace egl_context_test {

TEST(EglContext, OpensOpenGl45CoreOrSaysWhyNot) {
    Result<EglContext> context = EglContext::create();
    if (!context) {
        EXPECT_EQ(context.error().code, ErrorCode::device_unavailable);
        EXPECT_NE(context.error().message, "");
        GTEST_SKIP() << context.error().message;
    }
    EXPECT_GE(epoxy_gl_version(), 45);
    EXPECT_NE(context->renderer_name(), "");
}

TEST(EglContext, TwoLiveSideBySideAndTakeTurns) {
    Result<EglContext> first = EglContext::create();
    if (!first) GTEST_SKIP() << first.error().message;
    {
        Result<EglContext> second = EglContext::create();
        ASSERT_TRUE(second) << second.error().message;
        first->make_current();
        second->make_current();
    }
    first->make_current();
    EXPECT_NE(glGetString(GL_RENDERER), nullptr);
}

TEST(EglContext, SurvivesAMove) {
    Result<EglContext> first = EglContext::create();
    if (!first) GTEST_SKIP() << first.error().message;
    EglContext moved = std::move(*first);
    moved.make_current();
    EXPECT_NE(glGetString(GL_RENDERER), nullptr);
}

TEST(EglContext, WithChecksAGlErrorIsAFailedResultOnce) {
    Result<EglContext> context = EglContext::create(GlChecks::on);
    if (!context) GTEST_SKIP() << context.error().message;
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
