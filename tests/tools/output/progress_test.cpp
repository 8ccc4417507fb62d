// SPDX-License-Identifier: MIT
#include "program/progress.h"

#include <gtest/gtest.h>

namespace terrane::tools {
namespace progress_test {

TEST(FormatProgress, ShowsTheElapsedTimeWhereTheShareIsUnknown) {
    EXPECT_EQ(format_progress("opening a.tif", -1.0, 3.2, 0.0, 0.0), "opening a.tif: 4 s");
}

TEST(FormatProgress, EstimatesTheTimeLeftFromTheSpeedSinceTheShareIsKnown) {
    // 10 s for 20 %, so 40 s for the rest; time before the first share does not count
    EXPECT_EQ(format_progress("flying", 0.2, 100.0, 0.0, 10.0), "flying: 20 %, 40 s left");
    EXPECT_EQ(format_progress("flying", 0.75, 500.0, 0.5, 200.0), "flying: 75 %, 3 min 20 s left");
    EXPECT_EQ(format_progress("flying", 0.5, 9e3, 0.0, 9000.0), "flying: 50 %, 2 h 30 min left");
    EXPECT_EQ(format_progress("flying", 1.0, 10.0, 0.0, 10.0), "flying: 100 %, 0 s left");
}

TEST(FormatProgress, EstimatesNothingFromTooSmallAShare) {
    EXPECT_EQ(format_progress("flying", 0.0, 10.0, 0.0, 10.0), "flying: 0 %");
    EXPECT_EQ(format_progress("flying", 0.5, 0.1, 0.0, 0.1), "flying: 50 %");
    EXPECT_EQ(format_progress("flying", 0.999, 10.0, 0.999, 10.0), "flying: 99 %");
}

}  // namespace progress_test
}  // namespace terrane::tools
