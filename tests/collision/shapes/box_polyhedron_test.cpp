// SPDX-License-Identifier: MIT
#include "hull_checks.h"
#include "shapes/polyhedron.h"
#include "shapes/query_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace terrane {
namespace box_polyhedron_test {

TEST(BoxPolyhedron, IsTheHullOfItsCorners) {
    internal::BoxStorage storage;
    const internal::Polyhedron box = internal::box_polyhedron({1.0, 0.25, 3.0}, storage);
    EXPECT_EQ(test::find_fault(box, 0.0), "");
    EXPECT_EQ(test::find_fault_of_hull(box, storage.vertices, 1e-15), "");
    const ConvexHull hull = ConvexHull::create(storage.vertices).value();
    const internal::Polyhedron& made = internal::polyhedron(hull);
    EXPECT_EQ(made.faces.size(), 6u);
    for (const auto& face : box.faces) {
        EXPECT_TRUE(std::any_of(made.faces.begin(), made.faces.end(), [&](const auto& other) {
            return other.normal == face.normal && other.offset == face.offset;
        }));
    }
}

TEST(BoxPolyhedron, KeepsItsTableWhenItIsFlat) {
    internal::BoxStorage storage;
    for (const Eigen::Vector3d& half : {Eigen::Vector3d(1.0, 0.0, 2.0),
                                        Eigen::Vector3d(0.0, 0.0, 1.0), Eigen::Vector3d(0, 0, 0)}) {
        const internal::Polyhedron box = internal::box_polyhedron(half, storage);
        EXPECT_EQ(box.vertices.size() + box.faces.size() - box.edges.size(), 2u);
        for (const auto& face : box.faces) {
            EXPECT_EQ(face.normal.norm(), 1.0);
            for (const Eigen::Vector3d& v : box.vertices) {
                EXPECT_LE(face.normal.dot(v), face.offset);
            }
            for (std::uint32_t i = 0; i < face.count; ++i) {
                EXPECT_EQ(face.normal.dot(box.vertices[box.loops[face.first + i]]), face.offset);
            }
        }
    }
}

}  // namespace box_polyhedron_test
}  // namespace terrane
