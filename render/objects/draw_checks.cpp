// SPDX-License-Identifier: MIT
#include "objects/draw_checks.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// Finite numbers keep their sum times 0; infinity and NaN do not.
template <class Record>
bool is_finite(const Record& record) {
    constexpr std::size_t kFloats = sizeof(Record) / sizeof(float);
    float sum = 0.0f;
    for (const float value : std::bit_cast<std::array<float, kFloats>>(record)) sum += 0.0f * value;
    return sum == 0.0f;
}

}  // namespace

Result<void> check_values(const SceneDraws& draws) {
    for (std::size_t i = 0; i < draws.instances.size(); ++i) {
        const ObjectInstance& instance = draws.instances[i];
        if (!is_finite(instance)) {
            return fail(ErrorCode::invalid_argument,
                        "instance " + number_text(i) + " must have finite numbers only");
        }
        if (!(instance.scale > 0.0f)) {
            return fail(ErrorCode::invalid_argument, "instance " + number_text(i) +
                                                         " must have a scale > 0, got " +
                                                         number_text(instance.scale));
        }
        if (!(instance.coverage >= -1.0f && instance.coverage <= 2.0f)) {
            return fail(ErrorCode::invalid_argument, "instance " + number_text(i) +
                                                         " must have a coverage of -1 to 2, got " +
                                                         number_text(instance.coverage));
        }
    }
    for (std::size_t i = 0; i < draws.particles.size(); ++i) {
        const Particle& particle = draws.particles[i];
        if (is_finite(particle) && particle.radius > 0.0f) continue;
        return fail(ErrorCode::invalid_argument,
                    "particle " + number_text(i) +
                        " must have finite numbers and a radius > 0, got " +
                        number_text(particle.radius));
    }
    return {};
}

Result<void> check_instances(const SceneDraws& draws, std::uint32_t first, std::uint32_t count) {
    if (std::size_t{first} + count <= draws.instances.size()) return {};
    return fail(ErrorCode::invalid_argument,
                "the scene has " + number_text(draws.instances.size()) +
                    " instances, a draw's end at " + number_text(std::size_t{first} + count));
}

Result<void> check_streamed(const StreamedDraw& streamed, std::size_t vertex_count) {
    if (!streamed.positions.empty() && streamed.positions.size() != vertex_count) {
        return fail(ErrorCode::invalid_argument,
                    "a streamed object must have one position a vertex, got " +
                        number_text(streamed.positions.size()) + " of " +
                        number_text(vertex_count));
    }
    for (const Eigen::Vector3f& p : streamed.positions) {
        if (p.allFinite()) continue;
        return fail(ErrorCode::invalid_argument,
                    "a streamed object must have finite positions, got one that is not at vertex " +
                        number_text(static_cast<std::size_t>(&p - streamed.positions.data())));
    }
    constexpr std::size_t kMostTriangles = std::numeric_limits<std::int32_t>::max() / 3;
    if (streamed.triangles.size() > kMostTriangles) {
        return fail(ErrorCode::invalid_argument,
                    "a streamed object must have at most " + number_text(kMostTriangles) +
                        " triangles, got " + number_text(streamed.triangles.size()));
    }
    for (const TriangleMesh::Triangle& t : streamed.triangles) {
        const std::uint32_t most = std::max({t[0], t[1], t[2]});
        if (most < vertex_count) continue;
        return fail(ErrorCode::invalid_argument, "a streamed triangle names vertex " +
                                                     number_text(most) + " of " +
                                                     number_text(vertex_count));
    }
    return {};
}

}  // namespace terrane::internal
