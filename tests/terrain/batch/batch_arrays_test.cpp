// SPDX-License-Identifier: MIT
//
// Arrays whose lengths do not agree are refused with a line that names them, and nothing is written.
#include "terrain/batch/batch_scene.h"

#include <terrane/terrain/ground_batch.h>

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace terrane {
namespace batch_arrays_test {

using test::make_batch_ground;

std::string message_of(const Result<void>& result) {
    return result ? std::string() : result.error().message;
}

class BatchArrays : public testing::Test {
protected:
    std::string refusal(const PointArray& points, const HeightArrays& out) {
        return message_of(batch.heights(ground, points, out));
    }

    const Ground ground = make_batch_ground();
    GroundBatch batch = GroundBatch::create().value();
    std::vector<double> nine = std::vector<double>(9, 1.0);
    std::vector<double> ten = std::vector<double>(10, 1.0);
    std::vector<double> written = std::vector<double>(9, -1.0);
    std::vector<GroundStatus> statuses = std::vector<GroundStatus>(9);
};

TEST_F(BatchArrays, AreRefusedWhereAnOutputIsTooShortOrTooLong) {
    const PointArray points = PointArray::separate(ten, ten);
    HeightArrays out;
    out.heights = written;
    EXPECT_EQ(refusal(points, out),
              "heights must be empty or have 1 entry for each of 10 items, has 9");
    out = {};
    out.normals = written;
    EXPECT_EQ(refusal(points, out),
              "normals must be empty or have 3 entries for each of 10 items, has 9");
    EXPECT_EQ(refusal(PointArray::separate(nine, nine), out),
              "normals must be empty or have 3 entries for each of 9 items, has 9");
    out = {};
    out.statuses = statuses;
    EXPECT_EQ(refusal(points, out),
              "statuses must be empty or have 1 entry for each of 10 items, has 9");
    out = {};
    out.errors_m = written;
    EXPECT_EQ(refusal(PointArray{}, out),
              "errors_m must be empty or have 1 entry for each of 0 items, has 9");
    EXPECT_EQ(written, std::vector<double>(9, -1.0));
}

TEST_F(BatchArrays, AreRefusedWhereACoordinateIsTooShort) {
    EXPECT_EQ(refusal(PointArray::separate(ten, nine), {}),
              "points_world.y must have at least 10 numbers for 10 points with stride 1, has 9");
    EXPECT_EQ(refusal(PointArray::interleaved_xy(nine), {}),
              "points_world.y must have at least 9 numbers for 5 points with stride 2, has 8");
    EXPECT_EQ(
        refusal({.count = std::numeric_limits<std::size_t>::max(), .stride = 3, .x = ten}, {}),
        "points_world.x must have at least 18446744073709551615 numbers for "
        "18446744073709551615 points with stride 3, has 10");
    EXPECT_EQ(refusal({.count = 1, .stride = 0}, {}),
              "points_world.x must have at least 1 numbers for 1 points with stride 0, has 0");
    EXPECT_EQ(refusal(PointArray::interleaved_xy(ten), {}), "");
}

TEST_F(BatchArrays, AreRefusedWhereRaysHaveNoHeightsOrNoEnds) {
    const PointArray flat = PointArray::interleaved_xy(ten);
    const PointArray three = PointArray::interleaved_xyz(nine);
    const PointArray five = PointArray::separate(std::span(ten).first(5), ten, ten);
    EXPECT_EQ(message_of(batch.rays(ground, three, five, {})),
              "to_world must have as many points as from_world, 3, has 5");
    EXPECT_EQ(message_of(batch.rays(ground, flat, five, {})),
              "from_world.z must have at least 9 numbers for 5 points with stride 2, has 0");
    EXPECT_EQ(message_of(batch.rays(ground, five, flat, {})),
              "to_world.z must have at least 9 numbers for 5 points with stride 2, has 0");
    EXPECT_EQ(message_of(batch.rays(ground, PointArray::interleaved_xyz(ten), five, {})),
              "to_world must have as many points as from_world, 4, has 5");
    RayArrays out;
    out.points_world = written;
    EXPECT_EQ(message_of(batch.rays(ground, five, five, out)),
              "points_world must be empty or have 3 entries for each of 5 items, has 9");
    EXPECT_EQ(written, std::vector<double>(9, -1.0));
}

TEST(GroundBatchSettings, AreRefusedWithoutAWorkerAndWithTooMany) {
    for (const int workers : {0, -1, 65}) {
        const auto batch = GroundBatch::create({.worker_count = workers});
        ASSERT_FALSE(batch);
        EXPECT_EQ(batch.error().message,
                  "worker_count must be 1 to 64, got " + std::to_string(workers));
    }
}

}  // namespace batch_arrays_test
}  // namespace terrane
