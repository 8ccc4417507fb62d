// SPDX-License-Identifier: MIT
#include "world/shape_bytes.h"

#include <type_traits>
#include <variant>

namespace terrane::internal {
namespace {

constexpr double kMostStoredSize = 1e5;  // metres; check(Shape) has the same limit
constexpr std::uint32_t kLastConvexKind = std::variant_size_v<ConvexShape> - 1;
constexpr std::uint32_t kLastKind = std::variant_size_v<Shape> - 1;
constexpr std::size_t kVertexBytes = 24, kLeastPartBytes = 104;

const void* data_of(const ConvexHull& hull) { return &hull_data(hull); }
const void* data_of(const Compound& compound) { return &compound_data(compound); }

}  // namespace

void ShapeWriter::write(const Shape& shape) {
    out_.word("kind", static_cast<std::uint32_t>(shape.index()));
    std::visit([this](const auto& each) { write_shape(each); }, shape);
}

void ShapeWriter::write_shape(const Sphere& sphere) {
    out_.number("radius", sphere.radius, 0.0, kMostStoredSize);
}

void ShapeWriter::write_shape(const Capsule& capsule) {
    out_.number("radius", capsule.radius, 0.0, kMostStoredSize);
    out_.number("half_height", capsule.half_height, 0.0, kMostStoredSize);
}

void ShapeWriter::write_shape(const Box& box) {
    out_.vector("half_extents", box.half_extents, kMostStoredSize);
}

void ShapeWriter::write_shape(const ConvexHull& hull) {
    if (!write_index(hulls_, data_of(hull))) return;
    out_.list("vertices", hull.vertices(), kVertexBytes, [this](const Eigen::Vector3d& vertex) {
        out_.vector("vertex", vertex, ConvexHull::kLargestCoordinate);
    });
}

void ShapeWriter::write_shape(const Compound& compound) {
    if (!write_index(compounds_, data_of(compound))) return;
    out_.list("parts", compound.parts(), kLeastPartBytes, [this](const CompoundPart& part) {
        out_.word("kind", static_cast<std::uint32_t>(part.shape.index()));
        std::visit([this](const auto& each) { write_shape(each); }, part.shape);
        out_.pose("pose", part.body_from_part);
    });
}

/// Writes the index of shared data. Returns whether the data must follow.
bool ShapeWriter::write_index(Indices& known, const void* data) {
    const auto [found, is_new] = known.emplace(data, static_cast<std::uint32_t>(known.size()));
    out_.word("index", found->second);
    return is_new;
}

Shape ShapeReader::read() { return read_kind<Shape>(kLastKind); }

template <class AnyShape>
AnyShape ShapeReader::read_kind(std::uint32_t last_kind) {
    std::uint32_t kind = 0;
    in_.integer("shape kind", kind, last_kind);
    if (kind == 0) {
        Sphere sphere;
        in_.number("radius", sphere.radius, 0.0, kMostStoredSize);
        return sphere;
    }
    if (kind == 1) {
        Capsule capsule;
        in_.number("radius", capsule.radius, 0.0, kMostStoredSize);
        in_.number("half_height", capsule.half_height, 0.0, kMostStoredSize);
        return capsule;
    }
    if (kind == 2) {
        Box box;
        for (int axis = 0; axis < 3; ++axis) {
            in_.number("half_extents", box.half_extents[axis], 0.0, kMostStoredSize);
        }
        return box;
    }
    if constexpr (std::is_same_v<AnyShape, Shape>) {
        if (kind == 4) return read_compound();
    }
    return read_hull();
}

ConvexHull ShapeReader::read_hull() {
    static const ConvexHull point = *ConvexHull::create(std::vector{Eigen::Vector3d(0, 0, 0)});
    std::uint32_t index = 0;
    in_.integer("hull index", index, static_cast<std::uint32_t>(hulls_.size()));
    if (in_.has_failed()) return point;
    if (index < hulls_.size()) return hulls_[index];
    std::vector<Eigen::Vector3d> vertices;
    in_.list("hull vertices", vertices, kVertexBytes, [this](Eigen::Vector3d& vertex) {
        in_.vector("hull vertex", vertex, ConvexHull::kLargestCoordinate);
    });
    if (in_.has_failed()) return point;
    const Result<ConvexHull> hull = ConvexHull::create(vertices);
    if (!hull) {
        in_.fail("hull", hull.error().message);
        return point;
    }
    return hulls_.emplace_back(*hull);
}

Compound ShapeReader::read_compound() {
    static const Compound sphere = *Compound::create(std::vector{CompoundPart{Sphere{}, {}}});
    std::uint32_t index = 0;
    in_.integer("compound index", index, static_cast<std::uint32_t>(compounds_.size()));
    if (in_.has_failed()) return sphere;
    if (index < compounds_.size()) return compounds_[index];
    std::vector<CompoundPart> parts;
    in_.list("compound parts", parts, kLeastPartBytes, [this](CompoundPart& part) {
        part.shape = read_kind<ConvexShape>(kLastConvexKind);
        in_.pose("pose of a compound part", part.body_from_part);
    });
    if (in_.has_failed()) return sphere;
    const Result<Compound> compound = Compound::create(parts);
    if (!compound) {
        in_.fail("compound", compound.error().message);
        return sphere;
    }
    return compounds_.emplace_back(*compound);
}

}  // namespace terrane::internal
