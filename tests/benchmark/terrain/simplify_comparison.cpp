// SPDX-License-Identifier: MIT
//
// Methods of simplification at the same count of triangles: distances and normals on samples of both surfaces, bad
// triangles and time. Exit code 1 where a sample is farther than a certified distance.
#include "base/aabb_tree.h"
#include "benchmark/bench.h"
#include "scene/mesh_files.h"
#include "support/meshes.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/simplify.h>
#include <terrane/terrain/simplify_mesh.h>

#include <Eigen/Geometry>

#if TERRANE_BENCH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace terrane::bench {
namespace {

using test::ShapeMesh;
using Triangle = std::array<std::uint32_t, 3>;

/// How far two surfaces are from each other, measured on samples of both.
struct SurfaceMeasure {
    double hausdorff = 0.0;      ///< largest distance of a sample of either from the other, metres
    double mean_distance = 0.0;  ///< over the area of both, metres
    double mean_normal_deg =
        0.0;  ///< angle to the normal at the nearest place of the other, over the area of both
    double max_normal_deg = 0.0;  ///< the largest such angle, degrees
    /// Triangles of the result near whose middle, within `hausdorff`, none of the input faces the same half-space.
    std::size_t flipped = 0;
    std::size_t folded =
        0;  ///< pairs of triangles of the result that lie on each other: at an edge, or all corners
    std::size_t degenerate = 0;  ///< triangles of the result lower than 1e-6 of their longest edge
};

// Source: P. Cignoni, C. Rocchini, R. Scopigno. Metro: Measuring Error on Simplified Surfaces. Computer Graphics Forum
// 17(2), 1998: samples of either surface and their nearest points on the other.

// Distances that differ by less than this share are the same: of those triangles the best normal counts.
constexpr double kTie = 1e-6;
constexpr double kFoldedCosine = 1.0 - 5e-9;  // a ten-thousandth of a radian
constexpr double kLeastHeight = 1e-6;         // over the longest edge

struct Nearest {
    double distance = 0.0;
    double cosine = 1.0;  // of the normals
};

Eigen::Vector3d area_vector(const ShapeMesh& mesh, const Triangle& t) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

double distance_to_box(const Eigen::Vector3d& p, const Aabb& box) {
    return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).norm();
}

// Nearest points of a mesh, found in a tree of boxes.
class SurfaceIndex {
public:
    explicit SurfaceIndex(const ShapeMesh& mesh) : mesh_(mesh) {
        std::vector<Aabb> boxes;
        for (const Triangle& t : mesh.triangles) {
            Aabb box{mesh.vertices[t[0]], mesh.vertices[t[0]]};
            for (const std::uint32_t v : t) {
                box.low = box.low.cwiseMin(mesh.vertices[v]);
                box.high = box.high.cwiseMax(mesh.vertices[v]);
            }
            boxes.push_back(box);
            normals_.push_back(area_vector(mesh, t).stableNormalized());
            size_ = size_.cwiseMax(box.high.cwiseAbs()).cwiseMax(box.low.cwiseAbs());
        }
        tree_ = internal::make_aabb_tree(boxes);
    }

    Nearest nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
        const auto bound = [&](const Aabb& box) { return distance_to_box(p, box); };
        double best = std::numeric_limits<double>::infinity();
        internal::visit_leaves_up_to(tree_, best, bound, [&](std::uint32_t i) {
            return best = std::min(best, distance(p, i));
        });
        Nearest result{.distance = best, .cosine = -1.0};
        result.cosine = largest_cosine(p, normal, best * (1.0 + kTie) + 1e-12 * size_.norm());
        return result;
    }

    /// Of the normals of all triangles within a distance; -1 where there is none.
    double largest_cosine(const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
                          double limit) const {
        const auto bound = [&](const Aabb& box) { return distance_to_box(p, box); };
        double largest = -1.0;
        internal::visit_leaves_up_to(tree_, limit, bound, [&](std::uint32_t i) {
            if (distance(p, i) <= limit) largest = std::max(largest, normals_[i].dot(normal));
            return limit;
        });
        return largest;
    }

    const Eigen::Vector3d& normal(std::size_t triangle) const { return normals_[triangle]; }

private:
    double distance(const Eigen::Vector3d& p, std::uint32_t i) const {
        const Triangle& t = mesh_.triangles[i];
        return test::distance_to_triangle(p, mesh_.vertices[t[0]], mesh_.vertices[t[1]],
                                          mesh_.vertices[t[2]]);
    }

    const ShapeMesh& mesh_;
    std::vector<Eigen::Vector3d> normals_;
    std::vector<internal::AabbNode> tree_;
    Eigen::Vector3d size_ = Eigen::Vector3d::Zero();
};

struct Sums {
    double area = 0.0, distance = 0.0, angle = 0.0;
};

// Places of a triangle with equal areas around: the corners of parts x parts of it, moved inside.
void add_samples(const ShapeMesh& from, const SurfaceIndex& index_from, const SurfaceIndex& to,
                 std::size_t samples, SurfaceMeasure& measure, Sums& sums) {
    double whole = 0.0;
    for (const Triangle& t : from.triangles) whole += area_vector(from, t).norm();
    for (std::size_t i = 0; i < from.triangles.size(); ++i) {
        const Triangle& t = from.triangles[i];
        const Eigen::Vector3d &a = from.vertices[t[0]], &b = from.vertices[t[1]],
                              &c = from.vertices[t[2]];
        const double area = area_vector(from, t).norm();
        for (const Eigen::Vector3d& corner : {a, b, c}) {
            const Nearest nearest = to.nearest(corner, index_from.normal(i));
            measure.hausdorff = std::max(measure.hausdorff, nearest.distance);
        }
        const double wanted = area / whole * static_cast<double>(samples);
        const int parts = std::max(1, static_cast<int>(std::sqrt(wanted)));
        const double share = area / (static_cast<double>(parts) * parts);
        const auto add = [&](double u, double v) {
            const Eigen::Vector3d p = a + u * (b - a) + v * (c - a);
            const Nearest nearest = to.nearest(p, index_from.normal(i));
            const double angle =
                std::acos(std::clamp(nearest.cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
            measure.hausdorff = std::max(measure.hausdorff, nearest.distance);
            sums.distance += share * nearest.distance;
            sums.area += share;
            if (!(area > 0.0)) return;
            sums.angle += share * angle;
            measure.max_normal_deg = std::max(measure.max_normal_deg, angle);
        };
        for (int row = 0; row < parts; ++row) {
            for (int column = 0; row + column < parts; ++column) {
                add((column + 1.0 / 3.0) / parts, (row + 1.0 / 3.0) / parts);
                if (row + column + 1 < parts)
                    add((column + 2.0 / 3.0) / parts, (row + 2.0 / 3.0) / parts);
            }
        }
    }
}

std::size_t count_folded(const ShapeMesh& mesh, const SurfaceIndex& index) {
    using Place = std::array<double, 3>;
    const auto place = [&](std::uint32_t v) -> Place {
        return {mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z()};
    };
    std::map<std::pair<Place, Place>, std::vector<std::size_t>> edges;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Place a = place(mesh.triangles[i][k]), b = place(mesh.triangles[i][(k + 1) % 3]);
            edges[std::minmax(a, b)].push_back(i);
        }
    }
    std::size_t count = 0;
    for (const auto& [edge, triangles] : edges) {
        if (triangles.size() != 2) continue;
        count += static_cast<std::size_t>(
            index.normal(triangles[0]).dot(index.normal(triangles[1])) < -kFoldedCosine);
    }
    return count;
}

/// Compares a result with its input by samples spread evenly over both areas, and all vertices. Of nearest triangles
/// at the same distance the one counts whose normal is nearest.
///
/// @param samples of each surface, about
SurfaceMeasure measure_surfaces(const ShapeMesh& input, const ShapeMesh& result,
                                std::size_t samples) {
    SurfaceMeasure measure;
    if (input.triangles.empty() || result.triangles.empty()) {
        const bool is_same = input.triangles.size() == result.triangles.size();
        measure.hausdorff = is_same ? 0.0 : std::numeric_limits<double>::infinity();
        return measure;
    }
    const SurfaceIndex of_input(input), of_result(result);
    Sums sums;
    add_samples(input, of_input, of_result, samples, measure, sums);
    add_samples(result, of_result, of_input, samples, measure, sums);
    if (sums.area > 0.0) {
        measure.mean_distance = sums.distance / sums.area;
        measure.mean_normal_deg = sums.angle / sums.area;
    }
    for (std::size_t i = 0; i < result.triangles.size(); ++i) {
        const Triangle& t = result.triangles[i];
        double longest = 0.0;
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            longest =
                std::max(longest, (result.vertices[t[k]] - result.vertices[t[(k + 1) % 3]]).norm());
            middle += result.vertices[t[k]] / 3.0;
        }
        const double height =
            longest > 0.0 ? 2.0 * area_vector(result, t).norm() / (longest * longest) : 0.0;
        if (!(height >= kLeastHeight)) {
            ++measure.degenerate;
        } else if (of_input.largest_cosine(middle, of_result.normal(i), measure.hausdorff) < 0.0) {
            ++measure.flipped;
        }
    }
    measure.folded = count_folded(result, of_result);
    return measure;
}

/// The result of a method: triangles of the input's vertices, or of its own.
struct Simplified {
    ShapeMesh mesh = {};
    double certified = -1.0;  ///< bound of the Hausdorff distance, metres; negative: it has none
    double ms = 0.0;          ///< processor time of the method alone, median of the runs
};

/// A method that reduces a mesh to about a number of triangles.
struct Simplifier {
    std::string name;
    Simplified (*run)(const ShapeMesh& mesh, std::size_t triangles, int runs) = nullptr;
};

/// Processor time: others may use the machine.
template <class Function>
double median_ms(int runs, const Function& function) {
    return tools::median_ms(runs, Clock::thread, function);
}

struct Options {
    bool is_quick = false;
    Choice only{"", Choice::Match::part};  // of methods
    int runs = 3;
};

Simplified run_simplify(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    Simplified result;
    const SimplifyLevel level{.triangles = triangles};
    std::vector<SimplifiedMesh> levels;
    result.ms = median_ms(runs, [&] {
        levels = simplify({mesh.vertices, mesh.triangles}, {&level, 1}).value();
    });
    result.mesh = {mesh.vertices, std::move(levels[0].triangles)};
    result.certified = levels[0].error_m;
    return result;
}

// With the record of all levels down to the count.
Simplified run_progressive(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    TriangleMesh input;
    input.positions = mesh.vertices;
    input.triangles = mesh.triangles;
    std::optional<ProgressiveMesh> made;
    Simplified result;
    result.ms = median_ms(runs, [&] {
        made.emplace(ProgressiveMesh::create(input, {.least_triangle_count = triangles}).value());
    });
    made->set_triangle_count(triangles);
    result.mesh.vertices = made->finest().positions;
    result.mesh.triangles.assign(made->triangles().begin(), made->triangles().end());
    result.certified = made->error_m();
    return result;
}

// With new vertices; the time includes that of the bound of the distance.
template <SimplifyMethod method>
Simplified run_new_vertices(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    TriangleMesh input;
    input.positions = mesh.vertices;
    input.triangles = mesh.triangles;
    SimplifiedCopy made;
    Simplified result;
    result.ms = median_ms(runs, [&] {
        made = simplify_mesh(input, {.method = method, .triangles = triangles}).value();
    });
    result.mesh = {std::move(made.mesh.positions), std::move(made.mesh.triangles)};
    result.certified = made.error_m;
    return result;
}

#if TERRANE_BENCH_MESHOPTIMIZER
// A. Kapoulkine, meshoptimizer: positions are float there, so that its own time is without the conversion.
template <class Simplify>
Simplified run_peer(const ShapeMesh& mesh, int runs, const Simplify& simplify) {
    std::vector<float> positions;
    std::vector<unsigned> indices;
    for (const Eigen::Vector3d& v : mesh.vertices) {
        for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(v[axis]));
    }
    for (const auto& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    std::vector<unsigned> made(indices.size());
    std::size_t count = 0;
    Simplified result;
    result.ms = median_ms(runs, [&] { count = simplify(made, indices, positions); });
    result.mesh.vertices = mesh.vertices;
    for (std::size_t i = 0; i < count; i += 3)
        result.mesh.triangles.push_back({made[i], made[i + 1], made[i + 2]});
    return result;
}

Simplified run_meshoptimizer(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    return run_peer(mesh, runs, [&](auto& made, const auto& indices, const auto& positions) {
        return meshopt_simplify(made.data(), indices.data(), indices.size(), positions.data(),
                                mesh.vertices.size(), 3 * sizeof(float), 3 * triangles, FLT_MAX, 0,
                                nullptr);
    });
}

Simplified run_meshoptimizer_sloppy(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    return run_peer(mesh, runs, [&](auto& made, const auto& indices, const auto& positions) {
        return meshopt_simplifySloppy(made.data(), indices.data(), indices.size(), positions.data(),
                                      mesh.vertices.size(), 3 * sizeof(float), 3 * triangles,
                                      FLT_MAX, nullptr);
    });
}
#endif

std::vector<Simplifier> all_simplifiers() {
    std::vector<Simplifier> all = {{"simplify()", run_simplify},
                                   {"ProgressiveMesh", run_progressive},
                                   {"optimal placement", run_new_vertices<SimplifyMethod::quadric>},
                                   {"decimation", run_new_vertices<SimplifyMethod::decimation>},
                                   {"clustering", run_new_vertices<SimplifyMethod::clustering>}};
#if TERRANE_BENCH_MESHOPTIMIZER
    all.push_back({"meshoptimizer", run_meshoptimizer});
    all.push_back({"meshoptimizer sloppy", run_meshoptimizer_sloppy});
#endif
    return all;
}

bool compare(const char* name, const ShapeMesh& mesh, Options& options) {
    const std::size_t count = mesh.triangles.size();
    std::printf("%s: %zu triangles\n", name, count);
    std::printf("  %5s %-22s %9s %10s %10s %10s %9s %9s %7s %6s %6s %9s\n", "share", "method",
                "triangles", "certified", "hausdorff", "mean", "normal", "max", "flipped", "folded",
                "flat", "ms");
    bool holds = true;
    for (const double share : {0.5, 0.1, 0.01}) {
        const auto target = static_cast<std::size_t>(share * static_cast<double>(count));
        for (const Simplifier& method : all_simplifiers()) {
            if (!options.only.has(method.name)) continue;
            const Simplified made = method.run(mesh, target, options.runs);
            const SurfaceMeasure m =
                measure_surfaces(mesh, made.mesh, options.is_quick ? 2'000 : 400'000);
            const bool is_within =
                made.certified < 0.0 || m.hausdorff <= made.certified * (1.0 + 1e-9) + 1e-9;
            holds &= is_within;
            std::printf(
                "  %4.0f%% %-22s %9zu %10.4g %10.4g %10.4g %9.3f %9.2f %7zu %6zu %6zu %9.2f%s\n",
                100.0 * share, method.name.c_str(), made.mesh.triangles.size(), made.certified,
                m.hausdorff, m.mean_distance, m.mean_normal_deg, m.max_normal_deg, m.flipped,
                m.folded, m.degenerate, made.ms, is_within ? "" : "  FAILED");
            std::fflush(stdout);
        }
    }
    return holds;
}

// Time of changes of level: it should depend on the change alone.
void measure_playing(const ShapeMesh& mesh, int runs) {
    TriangleMesh input;
    input.positions = mesh.vertices;
    input.triangles = mesh.triangles;
    ProgressiveMesh made = ProgressiveMesh::create(input).value();
    const auto count = static_cast<double>(mesh.triangles.size());
    std::printf("changes of level, there and back:\n");
    std::printf("  %10s %10s %10s %14s\n", "from", "to", "ms", "ns a triangle");
    for (const double from : {1.0, 0.1, 0.01}) {
        for (const double share : {0.1, 0.01, 0.001}) {
            const auto fine = static_cast<std::size_t>(from * count);
            const auto coarse = static_cast<std::size_t>(from * count - share * from * count);
            made.set_triangle_count(fine);
            constexpr int kRepeats = 20;
            const double ms = median_ms(runs, [&] {
                for (int i = 0; i < kRepeats; ++i) {
                    made.set_triangle_count(coarse);
                    made.set_triangle_count(fine);
                }
            });
            const double one = ms / (2.0 * kRepeats);
            std::printf("  %10zu %10zu %10.5f %14.1f\n", fine, coarse, one,
                        1e6 * one / std::max(1.0, share * from * count));
        }
    }
}

std::string data_folder() {
    const char* folder = std::getenv("TERRANE_DATA");
    return folder != nullptr ? folder : TERRANE_SOURCE_DIR "/../shared/data";
}

ShapeMesh make_fractal_mesh(int side) {
    constexpr double kCell = 4.0;
    const auto source = FractalHeights::create({.seed = 20}).value();
    return test::make_grid(side, side, [&](int column, int row) {
        const double x = kCell * column, y = kCell * row;
        return Eigen::Vector3d(x, y, source->height(x, y));
    });
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane;
    using namespace terrane::bench;
    Arguments arguments(argc, argv,
                        "simplify_comparison [--quick] [--only METHOD] [--mesh FILE.obj]");
    Options options;
    options.is_quick = arguments.has("--quick");
    if (options.is_quick) options.runs = 1;
    options.only = {arguments.text("--only", ""), Choice::Match::part};
    const std::string given = arguments.text("--mesh", "");
    arguments.finish();
    std::printf("%s\n", describe_machine().c_str());
    bool holds = true;
    std::vector<std::string> models = {given};
    if (given.empty()) {
        models = {data_folder() + "/models/fcl_env.obj", data_folder() + "/models/fcl_rob.obj",
                  TERRANE_SOURCE_DIR "/tools/data/boulder.obj",
                  TERRANE_SOURCE_DIR "/tools/data/pine.obj"};
    }
    for (const std::string& model : models) {
        if (const Result<TriangleMesh> mesh = tools::read_mesh(model)) {
            holds &= compare(model.substr(model.rfind('/') + 1).c_str(),
                             {mesh->positions, mesh->triangles}, options);
        } else {
            std::printf("left out: %s\n", mesh.error().message.c_str());
        }
    }
    if (given.empty()) {
        holds &= compare("sphere", test::make_sphere(10.0, options.is_quick ? 3 : 5), options);
        holds &= compare("torus",
                         options.is_quick ? test::make_torus(5.0, 2.0, 40, 20)
                                          : test::make_torus(5.0, 2.0, 160, 80),
                         options);
        const test::ShapeMesh fractal = make_fractal_mesh(options.is_quick ? 40 : 500);
        holds &= compare("fractal of seed 20, cells of 4 m", fractal, options);
        measure_playing(fractal, options.runs);
    }
    options.only.finish(arguments);
    if (!holds) std::printf("FAILED: a sample is farther than the certified distance\n");
    return holds ? 0 : 1;
}
