// SPDX-License-Identifier: MIT
#include "mesh/mesh_file.h"
#include "options/command.h"
#include "options/option_values.h"
#include "output/summary.h"
#include "scene/mesh/mesh_reader.h"

#include <terrane/terrain/progressive_mesh.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

namespace terrane::tools {
namespace {

struct SimplifyOptions {
    std::string in, out;
    std::size_t triangles = 0;
    double error_m = std::numeric_limits<double>::infinity();
    bool has_limit = false;
    bool json = false;
};

struct SimplifiedFile {
    IndexedMesh mesh;
    double error_m = 0.0;
    const char* stop = "";
};

/// Moves a mesh that is far from the origin to it, by whole metres. Returns what rounding adds to distances, metres.
double move_to_origin(TriangleMesh& mesh) {
    double largest = 0.0;
    for (const Eigen::Vector3d& p : mesh.positions)
        largest = std::max(largest, p.cwiseAbs().maxCoeff());
    // Refused where it is not finite.
    if (!(largest > kLargestMeshCoordinate) || !std::isfinite(largest)) return 0.0;
    const Eigen::Vector3d origin = mesh.positions.front().array().floor();
    for (Eigen::Vector3d& p : mesh.positions) p -= origin;
    return 2.0 * largest * std::numeric_limits<double>::epsilon();
}

/// Sets the first level that meets one of the limits, and says which.
const char* set_level(ProgressiveMesh& mesh, std::size_t triangles, double error_m) {
    mesh.set_triangle_count(triangles);
    const bool meets_count = mesh.triangles().size() <= triangles;
    if (mesh.error_m() > error_m) {
        mesh.set_error(error_m);
        return "error";
    }
    return meets_count ? "triangles" : "no_contraction";
}

/// The mesh at one level, with the vertices that its triangles use, in the order of the input.
Result<SimplifiedFile> simplify_to(const TriangleMesh& mesh, const SimplifyOptions& options) {
    TriangleMesh near = mesh;
    const double rounding = move_to_origin(near);
    Result<ProgressiveMesh> made =
        ProgressiveMesh::create(near, {.least_triangle_count = options.triangles});
    if (!made) return tl::unexpected<Error>(made.error());
    if (made->triangles().empty())
        return fail(ErrorCode::bad_data, "all of its triangles have two corners in one place");
    SimplifiedFile file;
    file.stop = set_level(*made, options.triangles, options.error_m - rounding);
    file.error_m = made->error_m() > 0.0 ? made->error_m() + rounding : 0.0;
    constexpr std::uint32_t kUnused = ~std::uint32_t{0};
    std::vector<std::uint32_t> number(mesh.positions.size(), kUnused);
    for (const auto& triangle : made->triangles()) {
        for (const std::uint32_t vertex : triangle) number[made->input_vertices()[vertex]] = 0;
    }
    for (std::size_t i = 0; i < number.size(); ++i) {
        if (number[i] == kUnused) continue;
        number[i] = static_cast<std::uint32_t>(file.mesh.vertices_world.size());
        file.mesh.vertices_world.push_back(mesh.positions[i]);
        if (!mesh.colours.empty()) file.mesh.colours.push_back(mesh.colours[i]);
        if (!mesh.normals.empty()) file.mesh.normals.push_back(mesh.normals[i]);
        if (!mesh.texture_coordinates.empty())
            file.mesh.texture_coordinates.push_back(mesh.texture_coordinates[i]);
    }
    std::vector<std::uint32_t> order(made->triangles().size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return made->input_triangles()[i]; });
    for (const std::uint32_t i : order) {
        TriangleMesh::Triangle triangle = made->triangles()[i];
        for (std::uint32_t& vertex : triangle) vertex = number[made->input_vertices()[vertex]];
        file.mesh.triangles.push_back(triangle);
    }
    return file;
}

CommandResult<void> run_simplify(const SimplifyOptions& options) {
    const std::optional<MeshFormat> format = mesh_format(options.out);
    if (!format) {
        return usage_error(fmt::format("OUT must end in {}, got '{}'", kMeshEndings, options.out));
    }
    if (!options.has_limit) {
        return usage_error("simplify needs --triangles or --error, or both");
    }
    const Result<TriangleMesh> mesh = read_mesh_with_attributes(options.in);
    if (!mesh) return pass_on(mesh.error());
    const auto start = std::chrono::steady_clock::now();
    const Result<SimplifiedFile> result = simplify_to(*mesh, options);
    const std::chrono::duration<double, std::milli> duration =
        std::chrono::steady_clock::now() - start;
    if (!result) {
        return failure(
            fmt::format("cannot simplify mesh '{}': {}", options.in, result.error().message));
    }
    const Result<void> written = write_mesh(result->mesh, *format, options.out);
    if (!written) return pass_on(written.error());

    nlohmann::ordered_json summary;
    summary["triangles"] = result->mesh.triangles.size();
    summary["vertices"] = result->mesh.vertices_world.size();
    summary["error_m"] = result->error_m;
    summary["ms"] = duration.count();
    summary["stop"] = result->stop;
    summary["input_triangles"] = mesh->triangles.size();
    summary["out"] = options.out;
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_simplify_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<SimplifyOptions>();
    CLI::App* simplify = app.add_subcommand(
        "simplify", "Reduces the triangles of a mesh file, with a certified error");
    simplify
        ->add_option("IN", options->in,
                     "File to read, .ply, .obj, .glb, .gltf or .stl: its positions, "
                     "triangles and colours of vertices, in metres; of .ply and .obj also normals "
                     "and texture coordinates")
        ->type_name("FILE")
        ->required();
    simplify
        ->add_option("OUT", options->out,
                     "File to write, .ply (binary, double), .obj or .glb (glTF, without "
                     "attributes). A file of that name is replaced; it may be IN")
        ->type_name("FILE")
        ->required();
    CLI::Option* const triangles = add_count(
        *simplify, "--triangles", options->triangles, 0,
        "Stop at this many triangles; 0: as few as can be. With --error: at the first of both");
    CLI::Option* const error =
        add_not_negative(*simplify, "--error", options->error_m,
                         "Stop before the two-sided Hausdorff distance to IN exceeds this, metres");
    simplify->add_flag("--json", options->json, "Print one JSON object");
    simplify->footer("Example: terrane simplify tools/data/boulder.obj boulder.ply --triangles 50");
    simplify->callback([&context, options, triangles, error] {
        options->has_limit = triangles->count() + error->count() > 0;
        context.run = [options] { return run_simplify(*options); };
    });
}

}  // namespace terrane::tools
