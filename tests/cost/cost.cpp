// SPDX-License-Identifier: MIT
#include "support/allocation_counter.h"
#include "support/random.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/function_heights.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <sys/resource.h>

#include <algorithm>
#include <cinttypes>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::test {

/// Objects that share a frame's triangle budget with the ground.
struct CostObjects {
    /// The triangles that the objects in view need at each threshold; valid until the next call.
    std::function<std::span<const TriangleDemand>(const View&)> demands;
    /// Chooses their levels of detail for a threshold, pixels, and returns the triangles of the frame's objects.
    std::function<std::size_t(double threshold_px)> draw;
};

/// What a flight and a drop are played in.
struct CostScene {
    std::shared_ptr<const HeightSource> source;  ///< of the ground around (0, 0)
    int body_count = 20;                         ///< of the drop
    std::unique_ptr<CostObjects> objects;        ///< null: none
};

/// The scenes that this program was built with: `plane`, `fractal` and `bodies`; with dem also `dem` and `dem_detail`;
/// with scene `objects`; with volume `volumes`; with all three `all`.
std::vector<std::string_view> cost_scene_names();

/// A scene by its name.
///
/// `bodies`, `objects` and `volumes` are the plane with 1000 bodies, 20,000 trees, a tunnel and a pit. `all` is all of
/// them on the DEM with detail.
///
/// @param dem path of the raster of `dem`, `dem_detail` and `all`
///
/// Fails: invalid_argument for an unknown name; as DemHeights::open()
Result<CostScene> make_cost_scene(std::string_view name, const std::string& dem);

/// What a flight and a drop came to.
struct CostRun {
    std::size_t ground_triangles = 0;  ///< summed over frames
    std::size_t object_triangles = 0;  ///< summed over frames
    std::uint64_t late_chunks = 0;     ///< summed over frames
    std::uint64_t awake_bodies = 0;    ///< summed over steps
    std::uint64_t fell_through =
        0;  ///< bodies deeper in the ground than their tolerance, summed over steps
    std::uint64_t hash = 0;  ///< of all meshes' sizes and of the bodies' states at the end
    int threads = 0;         ///< of the process at the end of the flight
    int threads_begun =
        0;  ///< of them, not there before; libraries begin some when they are loaded
};

/// Flies a camera over the ground around (0, 0) while bodies fall on it: a frame and a step of 1/60 s in turn. Chunks
/// are loaded by the calling thread, so the same scene gives the same instructions.
///
/// Not inlined: callgrind counts what it does by its name.
///
/// Fails: as the functions that make a pager, a triangulator and a world
[[gnu::noinline]] Result<CostRun> play_cost_scene(const CostScene& scene, int frames);

}  // namespace terrane::test

#if TERRANE_COST_DEM
#include <terrane/dem/dem_heights.h>
#endif
#if TERRANE_COST_SCENE
#include "scene/random_scene.h"

#include <terrane/scene/scene.h>
#endif
#if TERRANE_COST_VOLUME
#include <terrane/volume/volume_heights.h>
#endif

namespace terrane::test {
namespace {

using Source = std::shared_ptr<const HeightSource>;

Result<Source> make_plane() {
    return heights_from_function([](double, double) { return 0.0; },
                                 {.extent = {-2048.0, -2048.0, 2048.0, 2048.0},
                                  .slope = 0.0,
                                  .range = HeightInterval{0.0, 0.0}});
}

// Low hills of 4 km x 4 km.
Result<Source> make_hills() {
    FractalSettings settings;
    settings.seed = 7;
    settings.octave_count = 6;
    settings.amplitude = 20.0;
    settings.wavelength_log2 = 10;
    settings.root_size_log2 = 11;
    return FractalHeights::create(settings);
}

#if TERRANE_COST_DEM
Result<Source> open_dem(const std::string& path, bool has_detail) {
    DemSettings settings;
    if (has_detail) {
        settings.finest_spacing = 1.0;
        settings.detail_seed = 7;
    }
    return DemHeights::open(path, settings);
}
#endif

#if TERRANE_COST_SCENE
// Trees over 4 km x 4 km, whose feet stand on the source's true surface.
Result<std::unique_ptr<CostObjects>> plant_trees(const HeightSource& source) {
    TERRANE_TRY(Scene created, Scene::create({}));
    const auto scene = std::make_shared<Scene>(std::move(created));
    TERRANE_TRY(const ModelId model, scene->add_model(tree_model()));
    Random random(7);
    std::vector<PlacedObject> trees = spread_objects(random, 20'000, 2000.0);
    for (PlacedObject& tree : trees) {
        WorldPos& place = tree.position;
        place.z() = source.height(place.x(), place.y());
    }
    TERRANE_TRY(add_instances(*scene, model, trees));
    auto objects = std::make_unique<CostObjects>();
    objects->demands = [scene](const View& view) { return scene->begin_frame(view); };
    objects->draw = [scene](double threshold_px) {
        scene->end_frame(threshold_px);
        return scene->counts().triangles;
    };
    return objects;
}
#endif

#if TERRANE_COST_VOLUME
// A pit under the bodies and a tunnel from it to the east, below the surface at (0, 0).
Result<Source> dig(const Source& heights) {
    const double z = heights->height(0.0, 0.0);
    VolumeOperation pit, tunnel;
    pit.shape = VolumeSphere{.radius = 8.0};
    pit.world_from_shape.translation = {0.0, 0.0, z};
    pit.voxel = 1.0;
    tunnel.shape = VolumeTube{.path_shape = {{0.0, 0.0, -4.0}, {200.0, 0.0, -4.0}}, .radius = 3.0};
    tunnel.world_from_shape.translation = {0.0, 0.0, z};
    tunnel.voxel = 1.0;
    const VolumeOperation operations[] = {pit, tunnel};
    TERRANE_TRY(const Volumes volumes, Volumes::create(heights->lattice(), operations));
    TERRANE_TRY(const auto joined, VolumeHeights::create(heights, volumes));
    return Source(joined);
}
#endif

Error unknown(std::string_view name) {
    std::string known;
    for (const std::string_view scene : cost_scene_names())
        known += (known.empty() ? "" : ", ") + std::string(scene);
    return {ErrorCode::invalid_argument,
            "no scene \"" + std::string(name) + "\"; known are " + known};
}

Result<Source> make_source(std::string_view name, [[maybe_unused]] const std::string& dem) {
    if (name == "fractal") return make_hills();
#if TERRANE_COST_DEM
    if (name == "dem") return open_dem(dem, false);
    if (name == "dem_detail" || name == "all") return open_dem(dem, true);
#endif
    return make_plane();
}

}  // namespace

std::vector<std::string_view> cost_scene_names() {
    return {
        "plane", "fractal", "bodies",
#if TERRANE_COST_DEM
            "dem", "dem_detail",
#endif
#if TERRANE_COST_SCENE
            "objects",
#endif
#if TERRANE_COST_VOLUME
            "volumes",
#endif
#if TERRANE_COST_DEM && TERRANE_COST_SCENE && TERRANE_COST_VOLUME
            "all",
#endif
    };
}

Result<CostScene> make_cost_scene(std::string_view name, const std::string& dem) {
    const std::vector<std::string_view> names = cost_scene_names();
    if (std::find(names.begin(), names.end(), name) == names.end())
        return tl::unexpected(unknown(name));
    TERRANE_TRY(Source source, make_source(name, dem));
    CostScene scene{.source = std::move(source), .objects = nullptr};
    if (name == "bodies" || name == "all") scene.body_count = 1000;
#if TERRANE_COST_SCENE
    if (name == "objects" || name == "all") {
        TERRANE_TRY(auto objects, plant_trees(*scene.source));
        scene.objects = std::move(objects);
    }
#endif
#if TERRANE_COST_VOLUME
    if (name == "volumes" || name == "all") {
        TERRANE_TRY(Source dug, dig(scene.source));
        scene.source = std::move(dug);
    }
#endif
    return scene;
}

namespace {

constexpr double kStep = 1.0 / 60.0;
constexpr double kSpeed = 100.0;     // of the camera, m/s
constexpr double kAltitude = 150.0;  // of the camera above the ground at (0, 0), metres
constexpr double kBodySpacing = 3.0;

// North over the bodies' place, 10 degrees down: the tangent is 0.176.
View flight_view(double ground_z, int frame) {
    const WorldPos eye(30.0, -800.0 + kSpeed * kStep * frame, ground_z + kAltitude);
    return look_at(eye, eye + Eigen::Vector3d(0.0, 100.0, -17.6), 1.0, 1280, 720).value();
}

// Spheres and boxes in turn, on a square grid, 0.1 to 0.7 m above the ground.
Result<void> add_bodies(World& world, const Ground& ground, int count) {
    int side = 1;
    while (side * side < count) ++side;
    for (int i = 0; i < count; ++i) {
        const double x = kBodySpacing * (i % side - 0.5 * (side - 1));
        const double y = kBodySpacing * (i / side - 0.5 * (side - 1));
        const HeightAnswer at = ground.height(x, y);
        BodyState state;
        state.pose.translation = {x, y, at.height + 0.6 + 0.1 * (i % 5)};
        BodySettings settings;
        settings.mass = 30.0;
        if (i % 2 == 0) {
            settings.shape = Sphere{.radius = 0.4};
        } else {
            settings.shape = Box{.half_extents = {0.3, 0.4, 0.5}};
        }
        TERRANE_TRY(world.add(settings, state));
    }
    return {};
}

int count_threads() {
    std::ifstream status("/proc/self/status");
    const std::string key = "Threads:";
    for (std::string line; std::getline(status, line);)
        if (line.starts_with(key)) return std::stoi(line.substr(key.size()));
    return 0;
}

}  // namespace

Result<CostRun> play_cost_scene(const CostScene& scene, int frames) {
    const int threads_before = count_threads();
    TERRANE_TRY(Pager pager, Pager::create(scene.source, {.worker_count = 0}));
    TERRANE_TRY(
        Triangulator triangulator,
        Triangulator::create(*scene.source, {.triangle_budget = 100'000, .max_error_px = 1.0}));
    TERRANE_TRY(World world, World::create({}));

    RequiredRegion start = pager.require({-60.0, -60.0, 60.0, 60.0}, 0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    const double ground_z = scene.source->height(0.0, 0.0);
    {
        const Ground ground = pager.ground();
        TERRANE_TRY(add_bodies(world, ground, scene.body_count));
    }
    start.release();

    CostRun run;
    Hash hash;
    CameraNeed camera{
        .view = flight_view(ground_z, 0), .velocity = {0.0, kSpeed, 0.0}, .threshold_px = 1.0};
    for (int frame = 0; frame < frames; ++frame) {
        camera.view = flight_view(ground_z, frame);
        pager.update({&camera, 1}, world.needs(), frame * kStep);

        const Ground ground = pager.ground();
        const StepReport report = world.step(ground, kStep);
        run.awake_bodies += report.awake;
        run.fell_through += report.too_deep;

        std::span<const TriangleDemand> demands;
        if (scene.objects) demands = scene.objects->demands(camera.view);
        const TerrainMesh mesh = triangulator.update(pager.resident(), camera.view, demands);
        if (scene.objects) run.object_triangles += scene.objects->draw(mesh.demand_threshold_px);
        camera.threshold_px = mesh.threshold_px;
        run.ground_triangles += mesh.triangle_count;
        run.late_chunks += pager.stats().late_chunks;
        hash.add(mesh.triangle_count);
        hash.add(mesh.error_px);
    }
    hash.add(world.state_hash());
    run.hash = hash.value();
    run.threads = count_threads();
    run.threads_begun = run.threads - threads_before;
    return run;
}

}  // namespace terrane::test

// Plays a flight and a drop in one scene and prints what they cost as one JSON object:
//
//     scene_cost SCENE [FRAMES [DEM]]
//
// Times are those of the processor, of all threads. Bytes allocated are those of operator new in the flight and drop;
// the peak is the largest resident set of the process, its libraries included.

namespace {

using terrane::test::AllocationCounter;

double processor_ms() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

std::uint64_t peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::uint64_t{1024} * static_cast<std::uint64_t>(usage.ru_maxrss);
}

int fail(const std::string& message) {
    std::fprintf(stderr, "cost: %s\n", message.c_str());
    return 1;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace terrane::test;
    if (argc < 2 || argc > 4) {
        std::fprintf(stderr, "usage: %s SCENE [FRAMES [DEM]]\n", argv[0]);
        return 2;
    }
    const int frames = argc > 2 ? std::atoi(argv[2]) : 120;
    if (frames < 1)
        return fail("FRAMES must be a number above 0, got '" + std::string(argv[2]) + "'");
    const std::string dem = argc > 3 ? argv[3] : TERRANE_SOURCE_DIR "/tools/data/jacksboro.tif";

    const double before_ms = processor_ms();
    const auto scene = make_cost_scene(argv[1], dem);
    if (!scene) return fail(scene.error().message);
    const AllocationCounter allocations;
    const double made_ms = processor_ms();
    const auto run = play_cost_scene(*scene, frames);
    if (!run) return fail(run.error().message);
    const double played_ms = processor_ms();

    std::printf("{\"scene\":\"%s\",\"frames\":%d,\"setup_ms\":%.3f,\"play_ms\":%.3f,", argv[1],
                frames, made_ms - before_ms, played_ms - made_ms);
    std::printf("\"allocations\":%" PRIu64 ",\"allocated_bytes\":%" PRIu64
                ",\"peak_bytes\":%" PRIu64 ",\"threads\":%d,\"threads_begun\":%d,",
                allocations.count(), allocations.bytes(), peak_bytes(), run->threads,
                run->threads_begun);
    std::printf("\"ground_triangles\":%zu,\"object_triangles\":%zu,\"late_chunks\":%" PRIu64
                ",\"awake_bodies\":%" PRIu64 ",\"fell_through\":%" PRIu64 ",\"hash\":\"%016" PRIx64
                "\"}\n",
                run->ground_triangles, run->object_triangles, run->late_chunks, run->awake_bodies,
                run->fell_through, run->hash);
    return 0;
}
