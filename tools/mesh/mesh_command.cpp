// SPDX-License-Identifier: MIT
#include "mesh/mesh_file.h"
#include "options/command.h"
#include "options/option_values.h"
#include "options/preset.h"
#include "output/progress.h"
#include "output/summary.h"
#include "source/limits.h"
#include "source/terrain_options.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

namespace terrane::tools {
namespace {

struct MeshOptions {
    TerrainOptions terrain;
    std::optional<WorldPos> eye_world;
    std::optional<WorldPos> look_world;
    double fov_deg = 60.0;
    ImageSize size;
    std::size_t budget = 100'000;
    double max_error_px = 1.0;
    double morph_ratio = 1.0;  // no morphing: there is no previous frame
    double memory_mb = 1024.0;
    std::string out;
    bool json = false;
};

/// Loading starts with this error threshold and halves it, so that a small triangle budget loads no chunks that it
/// cannot draw.
constexpr double kFirstThreshold_px = 4096.0;
constexpr int kMaxRounds = 64;

Result<View> make_view(const MeshOptions& options, const Terrain& terrain) {
    const HeightSource& source = *terrain.source;
    const WorldRect region = work_region(terrain);
    const WorldVec2 centre = start_of(terrain);
    const double side = std::min(region.east - region.west, region.north - region.south);
    const WorldPos target_world = options.look_world.value_or(
        WorldPos(centre.x(), centre.y(), source.height(centre.x(), centre.y())));
    // default eye: south of the target, and above the ground there
    WorldPos eye_world = target_world + Eigen::Vector3d(0.0, -side / 4.0, side / 8.0);
    eye_world.z() =
        std::max(eye_world.z(), source.height(eye_world.x(), eye_world.y()) + side / 16.0);
    return look_at(options.eye_world.value_or(eye_world), target_world,
                   options.fov_deg * std::numbers::pi / 180.0, options.size.width_px,
                   options.size.height_px);
}

/// Samples the terrain where the view looks by default, to get the error that HeightSource::height() cannot report.
Result<void> read_middle(const Terrain& terrain) {
    const HeightSource& source = *terrain.source;
    const Lattice& lattice = source.lattice();
    const WorldVec2 middle = start_of(terrain);
    const auto index = [&lattice](double place, double origin) {
        return static_cast<std::int64_t>(std::floor((place - origin) / lattice.spacing));
    };
    const SampleGrid grid{
        {index(middle.x(), lattice.origin_x), index(middle.y(), lattice.origin_y)}, 1, 2, 2};
    std::array<double, 4> heights{};
    return source.sample(grid, heights);
}

/// Alternates loading and triangulation until the mesh needs no absent chunk.
CommandResult<TerrainMesh> load_until_stable(Pager& pager, Triangulator& triangulator,
                                             const View& view, double memory_mb) {
    const Progress progress("loading");
    double wanted_px = kFirstThreshold_px;
    std::uint64_t last_epoch = 0;
    for (int round = 0; round < kMaxRounds; ++round) {
        const std::array cameras{CameraNeed{.view = view, .threshold_px = wanted_px}};
        pager.update(cameras, {}, static_cast<double>(round));
        pager.finish();
        const PagerStats stats = pager.stats();
        if (stats.failed > 0) return failure("the terrain's heights could not be read");
        const TerrainMesh mesh = triangulator.update(pager.resident(), view);
        if (stats.late_chunks > 0) {
            return failure(
                fmt::format("--memory-mb {:.6g} is too small for this view: {} chunks did not fit",
                            memory_mb, stats.late_chunks));
        }
        // everything above wanted_px is resident: stable where the mesh cannot use more
        const bool is_stable =
            mesh.threshold_px >= wanted_px && mesh.resident->epoch() == last_epoch;
        if (is_stable && mesh.status != MeshStatus::not_resident) return mesh;
        last_epoch = mesh.resident->epoch();
        wanted_px = std::max(mesh.threshold_px, 0.5 * wanted_px);
    }
    return failure(fmt::format("the mesh did not settle in {} rounds of loading", kMaxRounds));
}

CommandResult<void> run_mesh(const MeshOptions& options) {
    const std::optional<MeshFormat> format = mesh_format(options.out);
    if (!options.out.empty() && !format) {
        return usage_error(
            fmt::format("--out must end in {}, got '{}'", kMeshEndings, options.out));
    }
    const CommandResult<Terrain> terrain = open_terrain(options.terrain);
    if (!terrain) return pass_on(terrain.error());
    if (const CommandResult<void> fit = check_budget(*terrain, options.budget); !fit) return fit;
    if (const CommandResult<void> fit = check_memory(*terrain, options.memory_mb); !fit) return fit;
    const Result<View> view = make_view(options, *terrain);
    if (!view) {
        const Result<void> read = read_middle(*terrain);
        if (!read) return pass_on(read.error());
        return usage_error(view.error().message);
    }
    Result<Triangulator> triangulator =
        Triangulator::create(*terrain->source, {.triangle_budget = options.budget,
                                                .max_error_px = options.max_error_px,
                                                .morph_ratio = options.morph_ratio});
    if (!triangulator) return pass_on(triangulator.error());
    PagerSettings paging;
    paging.memory_bytes = static_cast<std::size_t>(options.memory_mb * 0x1p20);
    paging.worker_count = 0;
    Result<Pager> pager = Pager::create(terrain->source, paging);
    if (!pager) return pass_on(pager.error());

    const CommandResult<TerrainMesh> mesh =
        load_until_stable(*pager, *triangulator, *view, options.memory_mb);
    if (!mesh) return pass_on(mesh.error());
    // the other formats have had positions only from the first
    const IndexedMesh welded =
        weld(*mesh, format == MeshFormat::glb ? Normals::with : Normals::without);
    if (!options.out.empty()) {
        const Result<void> written = write_mesh(welded, *format, options.out);
        if (!written) return pass_on(written.error());
    }

    const auto as_array = [](const Eigen::Vector3d& v) { return std::array{v.x(), v.y(), v.z()}; };
    nlohmann::ordered_json summary;
    summary["triangles"] = welded.triangles.size();
    summary["vertices"] = welded.vertices_world.size();
    summary["error_px"] = mesh->error_px;
    summary["status"] = name_of(mesh->status);
    summary["eye_m"] = as_array(view->eye_world);
    summary["forward"] = as_array(view->forward);
    if (!options.out.empty()) summary["out"] = options.out;
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_mesh_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<MeshOptions>();
    CLI::App* mesh = app.add_subcommand(
        "mesh", "Makes the mesh of one view, with everything loaded that it needs, and writes it");
    add_terrain_options(*mesh, options->terrain);
    add_point(*mesh, "--eye", options->eye_world,
              "Where the camera is, metres; without it south of the point looked at, and above");
    add_point(*mesh, "--look", options->look_world,
              "The point looked at, metres; without it the ground at --start-m");
    add_in_range(*mesh, "--fov-deg", options->fov_deg, 0.1, 179.0,
                 "Vertical field of view, degrees");
    add_size(*mesh, "--size", options->size, "Size of the picture, pixels");
    add_count(*mesh, "--budget", options->budget, 1, "Most triangles", kMostTriangles);
    add_positive(*mesh, "--max-error-px", options->max_error_px,
                 "Refinement stops below this screen error, pixels");
    add_in_range(
        *mesh, "--morph-ratio", options->morph_ratio, 1.0, 16.0,
        "Vertices slide in while their priority grows by this factor, as in a flight; 1: no "
        "morphing");
    add_in_range(*mesh, "--memory-mb", options->memory_mb, 0.001, 0x1p32,
                 "Most memory that chunks take, MB of 2^20 bytes");
    mesh->add_option("--out", options->out,
                     "File to write, .ply (binary, double), .obj or .glb (glTF): one indexed mesh, "
                     "counter-clockwise from above. A file of that name is replaced")
        ->type_name("FILE");
    mesh->add_flag("--json", options->json, "Print one JSON object");
    add_preset_option(*mesh);
    mesh->footer(
        "Example: terrane mesh --dem tools/data/jacksboro.tif --budget 20000 --out jacksboro.ply");
    mesh->callback([&context, options] { context.run = [options] { return run_mesh(*options); }; });
}

}  // namespace terrane::tools
