// SPDX-License-Identifier: MIT
#pragma once

#include "world/world_bytes.h"

#include <terrane/collision/shapes.h>

#include <unordered_map>
#include <vector>

// Shapes as fields. A hull is its vertices and a compound its parts: create() makes the same bits of them again. Hulls
// and compounds that share their data are written once.
namespace terrane::internal {

/// Writes shapes, and knows which hulls and compounds it has written.
class ShapeWriter {
public:
    explicit ShapeWriter(FieldWriter& out) : out_(out) {}

    void write(const Shape& shape);

private:
    void write_shape(const Sphere& sphere);
    void write_shape(const Capsule& capsule);
    void write_shape(const Box& box);
    void write_shape(const ConvexHull& hull);
    void write_shape(const Compound& compound);
    using Indices = std::unordered_map<const void*, std::uint32_t>;
    bool write_index(Indices& known, const void* data);

    FieldWriter& out_;
    Indices hulls_, compounds_;  // of shared data, in the order in which it was written
};

/// Reads what a ShapeWriter has written.
class ShapeReader {
public:
    explicit ShapeReader(FieldReader& in) : in_(in) {}

    /// A sphere where the reader fails.
    Shape read();

private:
    template <class AnyShape>
    AnyShape read_kind(std::uint32_t last_kind);
    ConvexHull read_hull();
    Compound read_compound();

    FieldReader& in_;
    std::vector<ConvexHull> hulls_;
    std::vector<Compound> compounds_;
};

}  // namespace terrane::internal
