// SPDX-License-Identifier: MIT
#include "mesh/mesh_file.h"
#include "options/command.h"
#include "options/option_values.h"
#include "output/summary.h"
#include "scene/mesh/mesh_reader.h"

#include <terrane/terrain/simplify.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <memory>
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
    SimplifyStop stop = SimplifyStop::triangle_count;
};

/// The mesh at one level, with the vertices that its triangles use, in the order of the input.
Result<SimplifiedFile> simplify_to(const TriangleMesh& mesh, const SimplifyLevel& level) {
    Result<std::vector<SimplifiedMesh>> levels =
        simplify({.vertices = mesh.positions, .triangles = mesh.triangles}, std::span(&level, 1));
    if (!levels) return tl::unexpected<Error>(levels.error());
    SimplifiedMesh& result = levels->front();
    SimplifiedFile file{.mesh = {}, .error_m = result.error_m, .stop = result.stop};
    std::vector<std::uint8_t> is_used(mesh.positions.size(), 0);
    for (const auto& triangle : result.triangles) {
        for (const std::uint32_t vertex : triangle) is_used[vertex] = 1;
    }
    std::vector<std::uint32_t> number(mesh.positions.size(), 0);
    for (std::size_t i = 0; i < is_used.size(); ++i) {
        if (is_used[i] == 0) continue;
        number[i] = static_cast<std::uint32_t>(file.mesh.vertices_world.size());
        file.mesh.vertices_world.push_back(mesh.positions[i]);
    }
    for (auto& triangle : result.triangles) {
        for (std::uint32_t& vertex : triangle) vertex = number[vertex];
    }
    file.mesh.triangles = std::move(result.triangles);
    return file;
}

const char* name_of_stop(SimplifyStop stop) {
    switch (stop) {
        case SimplifyStop::triangle_count:
            return "triangles";
        case SimplifyStop::error_limit:
            return "error";
        case SimplifyStop::no_contraction:
            break;
    }
    return "no_contraction";
}

CommandResult<void> run_simplify(const SimplifyOptions& options) {
    const std::optional<MeshFormat> format = mesh_format(options.out);
    if (!format) {
        return usage_error(fmt::format("OUT must end in {}, got '{}'", kMeshEndings, options.out));
    }
    if (!options.has_limit) {
        return usage_error("simplify needs --triangles or --error, or both");
    }
    const Result<TriangleMesh> mesh = read_mesh(options.in);
    if (!mesh) return pass_on(mesh.error());
    const auto start = std::chrono::steady_clock::now();
    const Result<SimplifiedFile> result =
        simplify_to(*mesh, {.triangles = options.triangles, .error_m = options.error_m});
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
    summary["stop"] = name_of_stop(result->stop);
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
                     "File to read, .ply, .obj, .glb, .gltf, .stl or .dae: its positions "
                     "and triangles, in metres")
        ->type_name("FILE")
        ->required();
    simplify
        ->add_option("OUT", options->out,
                     "File to write, .ply (binary, double), .obj or .glb (glTF). A file of that "
                     "name is replaced; it may be IN")
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
