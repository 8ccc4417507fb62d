// SPDX-License-Identifier: MIT
#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "render/gl_test.h"

#include <gtest/gtest.h>

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
}  // namespace terrane::internal
