// SPDX-License-Identifier: MIT
#include "reference_maps.h"
#include "support/random.h"

#include <terrane/terrain/check_source.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane::test {
namespace reference_maps_test {

TEST(ReferenceMap, OfContactIsAsSteepAsItsFiguresSay) {
    const HeightTable table = make_contact_table(1025, 1.0);
    double sum = 0.0, steepest = 0.0;
    for (int y = 0; y + 1 < table.rows; ++y) {
        for (int x = 0; x + 1 < table.columns; ++x) {
            const double here = static_cast<double>(table.at(x, y));
            const double slope = std::hypot(static_cast<double>(table.at(x + 1, y)) - here,
                                            static_cast<double>(table.at(x, y + 1)) - here);
            sum += slope;
            steepest = std::max(steepest, slope);
        }
    }
    EXPECT_NEAR(sum / (1024.0 * 1024.0), 0.375, 0.0005);
    EXPECT_NEAR(steepest, 1.59, 0.005);
}

TEST(ReferenceMap, OfContactHasTheSameHillsAtEverySpacing) {
    const HeightTable coarse = make_contact_table(9, 1.0);
    const HeightTable fine = make_contact_table(33, 0.25);
    for (int y = 0; y < 9; ++y) {
        for (int x = 0; x < 9; ++x) EXPECT_EQ(coarse.at(x, y), fine.at(4 * x, 4 * y));
    }
}

TEST(TableHeights, KeepsTheLawsOfASource) {
    struct Case {
        int columns, rows;
        int roots_x, roots_y, finest_level;
    };
    for (const Case& each : {Case{300, 200, 3, 2, 0}, Case{513, 513, 1, 1, 2}}) {
        SCOPED_TRACE(each.columns);
        HeightTable table{.columns = each.columns, .rows = each.rows};
        Random random(6);
        for (int i = 0; i < each.columns * each.rows; ++i) {
            table.heights.push_back(static_cast<float>(random.between(-20.0, 30.0)));
        }
        const TableHeights source(std::move(table));
        EXPECT_EQ(source.lattice().root_count_x, each.roots_x);
        EXPECT_EQ(source.lattice().root_count_y, each.roots_y);
        EXPECT_EQ(source.lattice().finest_level, each.finest_level);
        EXPECT_EQ(source.extent().east, each.columns - 1.0);
        const SourceReport report = check_source(source, {.places = 4}).value();
        EXPECT_TRUE(report.is_clean()) << to_text(report);
    }
}

}  // namespace reference_maps_test
}  // namespace terrane::test
