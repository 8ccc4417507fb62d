// SPDX-License-Identifier: MIT
#include "raster/cancellable_work.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

namespace terrane::internal {
namespace guarded_calls_test {

constexpr double kForEver = std::numeric_limits<double>::infinity();

TEST(GuardedCalls, RunEveryCallOneAtATimeFromAnyThread) {
    GuardedCalls calls(kForEver);
    int count = 0;  // no atomic: calls do not overlap
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
        threads.emplace_back([&] {
            for (int k = 0; k < 250; ++k) EXPECT_TRUE(calls.run([&count] { ++count; }));
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(count, 1000);
}

TEST(GuardedCalls, PassOnWhatACallThrows) {
    GuardedCalls calls(kForEver);
    EXPECT_THROW(calls.run([] { throw std::runtime_error("damaged"); }), std::runtime_error);
    int count = 0;
    EXPECT_TRUE(calls.run([&count] { ++count; }));
    EXPECT_EQ(count, 1);
}

TEST(GuardedCalls, GiveUpACallThatDoesNotReturnAndEveryOneAfterIt) {
    const auto is_free = std::make_shared<std::atomic<bool>>(false);
    {
        GuardedCalls calls(0.05);
        EXPECT_FALSE(calls.run([is_free] {
            while (!*is_free) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }));
        EXPECT_FALSE(calls.run([] { FAIL() << "ran after a call that was given up"; }));
    }
    *is_free = true;
}

TEST(GuardedCallsDeathTest, AProcessWithACallThatWasGivenUpEndsWithItsStatus) {
    testing::GTEST_FLAG(death_test_style) = "threadsafe";
    EXPECT_EXIT(
        {
            // A destructor that the call in the background would meet.
            static const struct AtEnd {
                ~AtEnd() { std::abort(); }
            } at_end;
            GuardedCalls calls(0.05);
            static_cast<void>(
                calls.run([] { std::this_thread::sleep_for(std::chrono::hours(1)); }));
            std::exit(7);
        },
        testing::ExitedWithCode(7), "");
}

}  // namespace guarded_calls_test
}  // namespace terrane::internal
