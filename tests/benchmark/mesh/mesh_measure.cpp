// SPDX-License-Identifier: MIT
#include "mesh_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace terrane::bench {
namespace {

constexpr int kMostCells = 8;   // of a triangle's width, with 4 x 4 points each
constexpr int kMostParts = 64;  // of a leg
constexpr int kFractalParts = 12;
constexpr std::size_t kRefined = 256;
constexpr int kRefinement = 4, kFractalRefinement = 8;

/// A displayed triangle; the parts of a table's triangle meet all samples inside it where they are
/// a multiple of twice its width.
struct Shown {
    std::array<Eigen::Vector3d, 3> corners;
    std::int64_t width = 0;  ///< of its longest side along an axis, finest spacings
};

template <class Visit>
void for_each_triangle(const TerrainMesh& mesh, const Visit& visit) {
    const Lattice& lattice = mesh.resident->lattice();
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            Shown shown;
            std::array<std::int64_t, 3> xs{}, ys{};
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint16_t sample = mesh.indices[part.first_index + i + k];
                xs[k] = chunk.corner.x + (sample % kChunkSamples) * chunk.step;
                ys[k] = chunk.corner.y + (sample / kChunkSamples) * chunk.step;
                shown.corners[k] = {lattice.x(xs[k]), lattice.y(ys[k]),
                                    part.displayed_height(sample, lattice.quantum)};
            }
            const auto [west, east] = std::minmax_element(xs.begin(), xs.end());
            const auto [south, north] = std::minmax_element(ys.begin(), ys.end());
            shown.width = std::max(*east - *west, *north - *south);
            visit(shown);
        }
    }
}

class Eye {
public:
    Eye(const View& view, const HeightSource& source)
        : view_(view), source_(source), frustum_(make_frustum(view)) {}

    /// False where no ground over a triangle can be in view.
    bool may_see(const Shown& shown) const {
        const auto& [a, b, c] = shown.corners;
        const double size = (a - b).norm() + (b - c).norm();
        double low = std::min({a.z(), b.z(), c.z()}), high = std::max({a.z(), b.z(), c.z()});
        const WorldRect rect{std::min({a.x(), b.x(), c.x()}), std::min({a.y(), b.y(), c.y()}),
                             std::max({a.x(), b.x(), c.x()}), std::max({a.y(), b.y(), c.y()})};
        const HeightInterval truth = source_.interval(rect);
        low = std::min(low, truth.low);
        high = std::max(high, truth.high);
        const double slack = high - low + 1e-9 * size;
        return std::ranges::none_of(frustum_.normals, [&](const Eigen::Vector3d& normal) {
            return std::ranges::all_of(shown.corners, [&](const Eigen::Vector3d& corner) {
                return normal.dot(corner - view_.eye_world) < -slack;
            });
        });
    }

    /// Largest error over the corners of parts x parts of a triangle.
    double measure(const Shown& shown, int parts, std::size_t& points) const {
        const auto& [a, b, c] = shown.corners;
        double worst = 0.0;
        for (int i = 0; i <= parts; ++i) {
            for (int j = 0; i + j <= parts; ++j) {
                const double u = static_cast<double>(i) / parts, v = static_cast<double>(j) / parts;
                const Eigen::Vector3d at = a + u * (b - a) + v * (c - a);
                if (!source_.extent().contains(at.x(), at.y())) continue;
                const Eigen::Vector3d truth(at.x(), at.y(), source_.height(at.x(), at.y()));
                const Eigen::Vector3d from_eye = truth - view_.eye_world;
                bool is_inside = true;
                for (const Eigen::Vector3d& normal : frustum_.normals) {
                    is_inside = is_inside && normal.dot(from_eye) >= 0.0;
                }
                if (!is_inside) continue;
                ++points;
                worst = std::max(worst, std::abs(at.z() - truth.z()) * view_.pixels_per_radian() /
                                            std::max(view_.near_distance, from_eye.norm()));
            }
        }
        return worst;
    }

private:
    const View& view_;
    const HeightSource& source_;
    Frustum frustum_;
};

int parts_of(const Shown& shown, bool is_fractal) {
    if (is_fractal) return kFractalParts;
    if (shown.width <= kMostCells) return static_cast<int>(4 * shown.width);
    return static_cast<int>(std::min<std::int64_t>(2 * shown.width, kMostParts));
}

}  // namespace

Measured measure_densely(const TerrainMesh& mesh, const HeightSource& source, const View& view,
                         bool is_fractal) {
    struct Candidate {
        double error_px;
        Shown shown;
    };
    const Eye eye(view, source);
    Measured measured;
    std::vector<Candidate> worst;
    const auto is_worse = [](const Candidate& a, const Candidate& b) {
        return a.error_px > b.error_px;
    };
    for_each_triangle(mesh, [&](const Shown& shown) {
        if (!eye.may_see(shown)) return;
        const double error = eye.measure(shown, parts_of(shown, is_fractal), measured.points);
        measured.error_px = std::max(measured.error_px, error);
        if (worst.size() == kRefined && error <= worst.front().error_px) return;
        worst.push_back({error, shown});
        std::ranges::push_heap(worst, is_worse);
        if (worst.size() <= kRefined) return;
        std::ranges::pop_heap(worst, is_worse);
        worst.pop_back();
    });
    for (const Candidate& candidate : worst) {
        const int parts =
            (is_fractal ? kFractalRefinement : kRefinement) * parts_of(candidate.shown, is_fractal);
        measured.error_px =
            std::max(measured.error_px, eye.measure(candidate.shown, parts, measured.points));
    }
    return measured;
}

double measure_samples(const TerrainMesh& mesh, const test::TableHeights& source) {
    double worst = 0.0;
    const double spacing = source.padded().spacing;
    for_each_triangle(mesh, [&](const Shown& shown) {
        const auto& [a, b, c] = shown.corners;
        const auto parts = static_cast<int>(2 * shown.width);
        for (int i = 0; i <= parts; ++i) {
            for (int j = 0; i + j <= parts; ++j) {
                const double u = static_cast<double>(i) / parts, v = static_cast<double>(j) / parts;
                const Eigen::Vector3d at = a + u * (b - a) + v * (c - a);
                const double x = at.x() / spacing, y = at.y() / spacing;
                if (std::abs(x - std::round(x)) > 1e-6 || std::abs(y - std::round(y)) > 1e-6) {
                    continue;
                }
                worst = std::max(worst, std::abs(at.z() - source.height(at.x(), at.y())));
            }
        }
    });
    return worst;
}

}  // namespace terrane::bench
