// SPDX-License-Identifier: MIT
#include "program/command.h"
#include "program/options.h"
#include "program/progress.h"
#include "program/summary.h"
#include "scene/mesh_files.h"
#include "scene/mesh_objects.h"
#include "scene/terrain_options.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/simplify_mesh.h>
#include <terrane/terrain/triangulator.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

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
    bool lonlat = false;
    bool no_objects = false;
    bool json = false;
};

/// Loading starts with this error threshold and halves it step by step, so as not to load chunks that the triangle
/// budget cannot draw.
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

/// Samples the terrain at the default target of the view, to detect errors that HeightSource::height() cannot report.
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

/// Alternates loading and triangulation until the mesh needs no further chunk.
///
/// @param of_objects demands on the same budget
CommandResult<TerrainMesh> load_until_stable(Pager& pager, Triangulator& triangulator,
                                             const View& view,
                                             std::span<const TriangleDemand> of_objects,
                                             double memory_mb) {
    const Progress progress("loading");
    double wanted_px = kFirstThreshold_px;
    std::uint64_t last_epoch = 0;
    for (int round = 0; round < kMaxRounds; ++round) {
        const std::array cameras{CameraNeed{.view = view, .threshold_px = wanted_px}};
        pager.update(cameras, {}, static_cast<double>(round));
        pager.finish();
        const PagerStats stats = pager.stats();
        if (stats.failed > 0) return failure("the terrain's heights could not be read");
        const TerrainMesh mesh = triangulator.update(pager.resident(), view, of_objects);
        if (stats.late_chunks > 0) {
            return failure(
                fmt::format("--memory-mb {:.6g} is too small for this view: {} chunks did not fit",
                            memory_mb, stats.late_chunks));
        }
        // all chunks for the threshold wanted_px are resident: the mesh is stable if it cannot use more
        const bool is_stable =
            mesh.threshold_px >= wanted_px && mesh.resident->epoch() == last_epoch;
        if (is_stable && mesh.status != MeshStatus::not_resident) return mesh;
        last_epoch = mesh.resident->epoch();
        wanted_px = std::max(mesh.threshold_px, 0.5 * wanted_px);
    }
    return failure(fmt::format("the mesh did not settle in {} rounds of loading", kMaxRounds));
}

/// The objects of a scene that the mesh has; none if it has no objects or --no-objects is given. Fails if the budget
/// does not suffice for the placed ones and the root squares.
CommandResult<std::optional<MeshObjects>> make_objects(const Terrain& terrain,
                                                       const MeshOptions& options, const View& view,
                                                       Normals normals) {
    if (terrain.objects == nullptr || options.no_objects) return std::optional<MeshObjects>();
    TERRANE_TRY(MeshObjects objects, MeshObjects::create(terrain.source, *terrain.objects, view,
                                                         options.max_error_px, normals));
    const auto roots = static_cast<std::size_t>(terrain.source->lattice().resident_root_count());
    const std::size_t least = 2 * roots + objects.least_triangles();
    if (options.budget < least) {
        return failure(fmt::format(
            "--budget must be at least {} for this scene, {} triangles for its {} placed objects "
            "at their coarsest and 2 for each of its root squares, got {}; or give --no-objects",
            least, objects.least_triangles(), objects.placed_count(), options.budget));
    }
    return std::optional<MeshObjects>(std::move(objects));
}

CommandResult<void> run_mesh(const MeshOptions& options) {
    const std::optional<MeshFormat> format = mesh_format(options.out);
    if (!options.out.empty() && !format) {
        return usage_error(
            fmt::format("--out must end in {}, got '{}'", kMeshEndings, options.out));
    }
    if (options.lonlat && format != MeshFormat::ply && format != MeshFormat::obj) {
        return usage_error("--lonlat needs --out with a file of doubles, .ply or .obj");
    }
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    TERRANE_TRY(check_budget(terrain, options.budget));
    TERRANE_TRY(check_memory(terrain, options.memory_mb));
    const Result<View> view = make_view(options, terrain);
    if (!view) {
        TERRANE_TRY(read_middle(terrain));
        return usage_error(view.error().message);
    }
    TERRANE_TRY(Triangulator triangulator,
                Triangulator::create(*terrain.source, {.triangle_budget = options.budget,
                                                       .max_error_px = options.max_error_px,
                                                       .morph_ratio = options.morph_ratio}));
    PagerSettings paging;
    paging.memory_bytes = static_cast<std::size_t>(options.memory_mb * 0x1p20);
    paging.worker_count = 0;
    TERRANE_TRY(Pager pager, Pager::create(terrain.source, paging));

    // the other formats are written without normals, for compatibility
    const Normals normals = format == MeshFormat::glb ? Normals::with : Normals::without;
    TERRANE_TRY(const std::optional<MeshObjects> objects,
                make_objects(terrain, options, *view, normals));
    TERRANE_TRY(const TerrainMesh mesh,
                load_until_stable(pager, triangulator, *view,
                                  objects ? objects->demands() : std::span<const TriangleDemand>(),
                                  options.memory_mb));
    IndexedMesh welded = weld(mesh, normals);
    MeshObjectCounts counts;
    if (objects) {
        if (!std::isfinite(mesh.demand_threshold_px)) {
            return failure(fmt::format(
                "--budget {} is too small for the volumes of this scene and {} triangles for its "
                "{} placed objects at their coarsest; or give --no-objects",
                options.budget, objects->least_triangles(), objects->placed_count()));
        }
        counts = objects->append_to(welded, mesh.demand_threshold_px);
    }
    if (options.lonlat) {
        const Result<Georeference> georeference = georeference_of(terrain);
        if (!georeference) {
            return failure("--lonlat needs a raster with a CRS: " + georeference.error().message);
        }
        georeference->lonlat_from_world(welded.vertices_world, welded.vertices_world);
        welded.is_lonlat = true;
    }
    if (!options.out.empty()) {
        TERRANE_TRY(write_mesh(welded, *format, options.out));
    }

    const auto as_array = [](const Eigen::Vector3d& v) { return std::array{v.x(), v.y(), v.z()}; };
    nlohmann::ordered_json summary;
    summary["triangles"] = welded.triangles.size();
    summary["vertices"] = welded.vertices_world.size();
    if (objects) {
        summary["ground_triangles"] = mesh.triangle_count;
        summary["object_triangles"] = counts.triangles;
        summary["objects"] = counts.objects;
        summary["objects_left_out"] = counts.left_out;
        summary["object_error_px"] = counts.error_px;
    }
    summary["error_px"] = mesh.error_px;
    summary["status"] = name_of(mesh.status);
    summary["eye_m"] = as_array(view->eye_world);
    summary["forward"] = as_array(view->forward);
    if (!options.out.empty()) summary["out"] = options.out;
    print_summary(summary, options.json);
    if (counts.left_out > 0) {
        print_note(fmt::format(
            "--budget {} leaves out {} scattered objects in view of more than --max-error-px",
            options.budget, counts.left_out));
    }
    return {};
}

}  // namespace

void add_mesh_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<MeshOptions>();
    CLI::App* mesh = app.add_subcommand(
        "mesh",
        "Makes the mesh of one view, with everything loaded that it needs, and writes it: the "
        "ground, and the objects of a scene. Placed objects are in it wherever they are, "
        "scattered ones where the view shows more than --max-error-px of them, at levels "
        "of detail within the view's error");
    add_terrain_options(*mesh, options->terrain, {"volumes", "objects"});
    add_point(*mesh, "--eye", options->eye_world,
              "Where the camera is, metres; without it south of the point looked at, and above");
    add_point(*mesh, "--look", options->look_world,
              "The point looked at, metres; without it the ground at --start-m");
    add_in_range(*mesh, "--fov-deg", options->fov_deg, 0.1, 179.0,
                 "Vertical field of view, degrees");
    add_size(*mesh, "--size", options->size, "Size of the picture, pixels");
    add_count(*mesh, "--budget", options->budget, 1,
              "Most triangles, of the ground and of a scene's objects together", kMostTriangles);
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
                     "counter-clockwise from outside. A file of that name is replaced")
        ->type_name("FILE");
    mesh->add_flag("--lonlat", options->lonlat,
                   "Write vertices as longitude and latitude, degrees in WGS 84, and height: above "
                   "the ellipsoid if info tells how the raster's heights are, otherwise the "
                   "raster's. .ply and .obj only");
    mesh->add_flag("--no-objects", options->no_objects, "Leave out the objects of the scene");
    mesh->add_flag("--json", options->json, "Print one JSON object");
    add_preset_option(*mesh);
    mesh->footer(
        "Example: terrane mesh --dem tools/data/jacksboro.tif --budget 20000 --out jacksboro.ply");
    mesh->callback([&context, options] { context.run = [options] { return run_mesh(*options); }; });
}

namespace {

struct SimplifyOptions {
    std::string in, out;
    SimplifyMeshSettings settings;
    bool is_optimal = false;  // new vertices, rather than the input's
    bool has_limit = false;
    bool has_placement = false;
    bool json = false;
};

struct SimplifiedFile {
    IndexedMesh mesh;
    double error_m = 0.0;
    const char* stop = "";
};

/// What a mesh was moved by, and the resulting rounding error of distances, metres.
struct MeshMove {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    double rounding = 0.0;
};

/// Moves a mesh that is far from the origin to the origin, by whole metres.
MeshMove move_to_origin(TriangleMesh& mesh) {
    double largest = 0.0;
    for (const Eigen::Vector3d& p : mesh.positions)
        largest = std::max(largest, p.cwiseAbs().maxCoeff());
    // meshes that are not finite are refused later
    if (!(largest > kLargestMeshCoordinate) || !std::isfinite(largest)) return {};
    const Eigen::Vector3d origin = mesh.positions.front().array().floor();
    for (Eigen::Vector3d& p : mesh.positions) p -= origin;
    return {origin, 2.0 * largest * std::numeric_limits<double>::epsilon()};
}

const char* name_of(SimplifyStop stop) {
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

constexpr const char* kNoTriangles = "all of its triangles have two corners in one place";

IndexedMesh to_indexed(TriangleMesh mesh) {
    return {.vertices_world = std::move(mesh.positions),
            .triangles = std::move(mesh.triangles),
            .colours = std::move(mesh.colours),
            .normals = std::move(mesh.normals),
            .texture_coordinates = std::move(mesh.texture_coordinates)};
}

/// The mesh with new vertices.
Result<SimplifiedFile> simplify_with_new_vertices(const TriangleMesh& mesh,
                                                  const SimplifyOptions& options) {
    TriangleMesh near = mesh;
    const MeshMove move = move_to_origin(near);
    SimplifyMeshSettings settings = options.settings;
    settings.error_m = std::max(settings.error_m - move.rounding, 0.0);
    TERRANE_TRY(SimplifiedCopy made, simplify_mesh(near, settings));
    if (made.mesh.triangles.empty()) return fail(ErrorCode::bad_data, kNoTriangles);
    SimplifiedFile file;
    file.stop = name_of(made.stop);
    file.error_m = made.error_m > 0.0 ? made.error_m + move.rounding : 0.0;
    for (Eigen::Vector3d& p : made.mesh.positions) p += move.origin;
    file.mesh = to_indexed(std::move(made.mesh));
    return file;
}

/// Simplifies a mesh to a number of triangles, but not beyond an error. Returns what ended this, for the summary.
const char* set_level(ProgressiveMesh& mesh, std::size_t triangles, double error_m) {
    mesh.set_triangle_count(triangles);
    const bool meets_count = mesh.triangles().size() <= triangles;
    if (mesh.error_m() > error_m) {
        mesh.set_error(error_m);
        return "error";
    }
    return meets_count ? "triangles" : "no_contraction";
}

/// The mesh at one level of half-edge contractions, with the vertices that its triangles use, in the order of the
/// input.
Result<SimplifiedFile> simplify_to(const TriangleMesh& mesh, const SimplifyOptions& options) {
    TriangleMesh near = mesh;
    const double rounding = move_to_origin(near).rounding;
    const SimplifyMeshSettings& settings = options.settings;
    TERRANE_TRY(ProgressiveMesh made,
                ProgressiveMesh::create(
                    near, {.normal_weight = settings.normal_weight,
                           .texture_coordinate_weight = settings.texture_coordinate_weight,
                           .colour_weight = settings.colour_weight,
                           .least_triangle_count = settings.triangles}));
    if (made.triangles().empty()) return fail(ErrorCode::bad_data, kNoTriangles);
    SimplifiedFile file;
    file.stop = set_level(made, settings.triangles, settings.error_m - rounding);
    file.error_m = made.error_m() > 0.0 ? made.error_m() + rounding : 0.0;
    TriangleMesh left = mesh;
    left.triangles.clear();
    std::vector<std::uint32_t> order(made.triangles().size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return made.input_triangles()[i]; });
    for (const std::uint32_t i : order) {
        TriangleMesh::Triangle triangle = made.triangles()[i];
        for (std::uint32_t& vertex : triangle) vertex = made.input_vertices()[vertex];
        left.triangles.push_back(triangle);
    }
    file.mesh = to_indexed(without_unused_vertices(left));
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
    if (options.has_placement && options.settings.method != SimplifyMethod::quadric) {
        return usage_error("--placement goes with --method quadric alone");
    }
    TERRANE_TRY(const TriangleMesh mesh, read_mesh_with_attributes(options.in));
    const auto start = std::chrono::steady_clock::now();
    const bool has_new_vertices =
        options.is_optimal || options.settings.method != SimplifyMethod::quadric;
    const Result<SimplifiedFile> result =
        has_new_vertices ? simplify_with_new_vertices(mesh, options) : simplify_to(mesh, options);
    const std::chrono::duration<double, std::milli> duration =
        std::chrono::steady_clock::now() - start;
    if (!result) {
        return failure(
            fmt::format("cannot simplify mesh '{}': {}", options.in, result.error().message));
    }
    TERRANE_TRY(write_mesh(result->mesh, *format, options.out));

    nlohmann::ordered_json summary;
    summary["triangles"] = result->mesh.triangles.size();
    summary["vertices"] = result->mesh.vertices_world.size();
    summary["error_m"] = result->error_m;
    summary["ms"] = duration.count();
    summary["stop"] = result->stop;
    summary["input_triangles"] = mesh.triangles.size();
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
        ->add_option(
            "IN", options->in,
            "File to read, .ply, .obj, .glb, .gltf or .stl: its positions, "
            "triangles and colours of vertices, in metres; of all but .stl also normals, of "
            ".ply and .obj texture coordinates")
        ->type_name("FILE")
        ->required();
    simplify
        ->add_option("OUT", options->out,
                     "File to write, .ply (binary, double), .obj or .glb (glTF, without "
                     "attributes). A file of that name is replaced; it may be IN")
        ->type_name("FILE")
        ->required();
    CLI::Option* const triangles = add_count(
        *simplify, "--triangles", options->settings.triangles, 0,
        "Stop at this many triangles; 0: as few as can be. With --error: at the first of both");
    CLI::Option* const error =
        add_not_negative(*simplify, "--error", options->settings.error_m,
                         "Stop before the two-sided Hausdorff distance to IN exceeds this, metres");
    add_choice(
        *simplify, "--method", {"quadric", "decimation", "clustering"}, 0,
        [options](std::size_t chosen) {
            options->settings.method = static_cast<SimplifyMethod>(chosen);
        },
        "quadric: contract edges in the order of quadric errors (Garland and Heckbert 1997); "
        "decimation: remove vertices near the plane of their neighbours (Schroeder et al. 1992), "
        "which keeps the topology; clustering: one vertex for each cell of a grid (Rossignac and "
        "Borrel 1993), the fastest");
    CLI::Option* const placement = add_choice(
        *simplify, "--placement", {"endpoint", "optimal"}, 0,
        [options](std::size_t chosen) { options->is_optimal = chosen == 1; },
        "Where a contraction of quadric puts the remaining vertex: at an end of the edge, so that "
        "all vertices are those of IN; or at the position, and with the normals, texture "
        "coordinates and colours, of least error");
    add_in_range(*simplify, "--normal-weight", options->settings.normal_weight, 0.0, 1e3,
                 "Weight of normals in the order and placement: the distance that counts as much "
                 "as a difference of 1, relative to the diagonal of IN; 0: normals do not count");
    add_in_range(*simplify, "--colour-weight", options->settings.colour_weight, 0.0, 1e3,
                 "The same for colours between 0 and 1");
    simplify->add_flag("--json", options->json, "Print one JSON object");
    simplify->footer("Example: terrane simplify tools/data/boulder.obj boulder.ply --triangles 50");
    simplify->callback([&context, options, triangles, error, placement] {
        options->has_limit = triangles->count() + error->count() > 0;
        options->has_placement = placement->count() > 0;
        context.run = [options] { return run_simplify(*options); };
    });
}

}  // namespace terrane::tools
