// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/offscreen.h>

#include <gtest/gtest.h>

#include <memory>
#include <utility>

namespace terrane::test {

/// A test with an OpenGL context that is current and checks calls; skipped where there is none.
class GlTest : public testing::Test {
protected:
    void SetUp() override {
        Result<EglContext> context = EglContext::create(GlChecks::on);
        if (!context) GTEST_SKIP() << context.error().message;
        context_ = std::make_unique<EglContext>(std::move(*context));
    }

    std::unique_ptr<EglContext> context_;
};

}  // namespace terrane::test
