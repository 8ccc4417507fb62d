// SPDX-License-Identifier: MIT
#include "conversions.h"
#include "terrain.h"

#include <pybind11/stl.h>

#include <functional>
#include <span>
#include <string>

#if TERRANE_PYTHON_DEM
#include <terrane/dem/dem_heights.h>
#include <terrane/dem/dem_note.h>
#include <terrane/dem/georeference.h>
#include <terrane/dem/imagery_raster.h>
#endif
#if TERRANE_PYTHON_REMOTE
#include <terrane/remote/http_files.h>
#endif
#if TERRANE_PYTHON_STORE
#include <terrane/store/chunk_store.h>
#include <terrane/store/sealed_file.h>
#include <terrane/store/shard_baker.h>
#endif

namespace terrane::python {
namespace {

#if TERRANE_PYTHON_DEM || TERRANE_PYTHON_STORE

std::string path_text(const py::object& path) {
    return py::cast<std::string>(py::module_::import("os").attr("fsdecode")(path));
}

// A Python callable as a progress function. It may run on any thread and acquires the interpreter lock there. An
// exception that it raises cancels the work; raise_pending() raises it again.
class Progress {
public:
    explicit Progress(const py::object& callable) {
        if (callable.is_none()) return;
        if (PyCallable_Check(callable.ptr()) == 0)
            throw py::type_error("progress must be callable or None");
        // The deleter acquires the lock, because an abandoned thread may release its reference without it.
        state_ = std::shared_ptr<State>(new State{callable, py::object()}, [](State* state) {
            const py::gil_scoped_acquire lock;
            delete state;
        });
    }

    std::function<bool(double)> function() const {
        if (state_ == nullptr) return {};
        return [state = state_](double share) {
            const py::gil_scoped_acquire lock;
            try {
                const py::object answer = state->callable(share);
                return answer.is_none() || py::cast<bool>(py::bool_(answer));
            } catch (py::error_already_set& error) {
                state->raised = error.value();
                return false;
            }
        };
    }

    void raise_pending() const {
        if (state_ == nullptr || !state_->raised) return;
        PyErr_SetObject(py::type::handle_of(state_->raised).ptr(), state_->raised.ptr());
        throw py::error_already_set();
    }

private:
    struct State {
        py::object callable, raised;
    };
    std::shared_ptr<State> state_;
};

#endif

#if TERRANE_PYTHON_DEM
constexpr std::array<std::pair<const char*, DemCache::Place>, 3> kCachePlaces{
    {{"none", DemCache::Place::none},
     {"beside", DemCache::Place::beside},
     {"folder", DemCache::Place::folder}}};
constexpr std::array<std::pair<const char*, HeightEncoding>, 4> kEncodings{
    {{"automatic", HeightEncoding::automatic},
     {"numbers", HeightEncoding::numbers},
     {"terrarium", HeightEncoding::terrarium},
     {"mapbox", HeightEncoding::mapbox}}};

constexpr std::array<std::pair<const char*, DemProjection>, 2> kProjections{
    {{"own", DemProjection::own}, {"local", DemProjection::local}}};

Source open_dem(const py::object& path, double finest_spacing, double spacing_tolerance,
                std::optional<std::uint64_t> detail_seed, double detail_roughness,
                const std::string& cache, const py::object& cache_folder,
                const py::object& scan_file, const std::string& height_unit, double height_scale,
                const std::optional<std::vector<double>>& nodata, const std::string& encoding,
                double cell, const std::string& projection,
                const std::optional<std::array<double, 4>>& crop, std::size_t memory_bytes,
                double read_timeout, const py::object& progress) {
    const Progress watched(progress);
    DemSettings settings;
    settings.finest_spacing = finest_spacing;
    settings.spacing_tolerance = spacing_tolerance;
    settings.detail_seed = detail_seed;
    settings.detail_roughness = detail_roughness;
    settings.memory_bytes = memory_bytes;
    settings.read_timeout = read_timeout;
    settings.progress = watched.function();
    settings.cache.place = read_choice(cache, "cache", kCachePlaces);
    settings.cache.folder = path_text(cache_folder);
    settings.scan_file = path_text(scan_file);
    settings.height_unit = height_unit;
    settings.height_scale = height_scale;
    settings.nodata = nodata;
    settings.encoding = read_choice(encoding, "encoding", kEncodings);
    settings.cell = cell;
    settings.projection = read_choice(projection, "projection", kProjections);
    settings.crop = crop;
    const std::string name = path_text(path);
    DemInfo info;
    auto source = without_lock([&] { return DemHeights::open(name, settings, &info); });
    watched.raise_pending();
    Source made{value_or_raise(std::move(source)), py::none()};
    made.dem = std::make_shared<const DemInfo>(info);
    made.file = name;
    made.samples_hash = info.samples_hash;
    made.note = note_of(info);
    made.make_georeference = [info] {
        return py::cast(value_or_raise(Georeference::create(info)));
    };
    made.info = make_answer(
        "DemInfo", info.columns, info.rows, py::make_tuple(info.cell_x, info.cell_y), info.min_m,
        info.max_m, info.nodata_share, info.filled_share, info.crs, info.crs_wkt, info.geographic,
        py::make_tuple(info.centre_x, info.centre_y),
        py::make_tuple(info.metres_per_unit_x, info.metres_per_unit_y), info.scale_error,
        info.from_cache, info.cache_note, info.numbers, info.height_unit, info.vertical_axis,
        info.nodata, info.placement, py::tuple(py::cast(info.notes)), info.resampling_error,
        info.projection == DemProjection::local ? "local" : "own",
        py::make_tuple(info.middle_longitude, info.middle_latitude), info.samples_hash);
    return made;
}

HeldImagery open_imagery(const py::object& path, const Source* aligned_with,
                         const std::vector<int>& bands,
                         const std::optional<std::array<double, 2>>& limits,
                         const std::optional<std::array<double, 2>>& percentiles, double gamma,
                         double read_timeout) {
    ImageryRasterSettings settings{.bands = bands,
                                   .limits = limits,
                                   .percentiles = percentiles,
                                   .gamma = gamma,
                                   .aligned_with = {},
                                   .read_timeout = read_timeout};
    if (aligned_with != nullptr) {
        if (aligned_with->dem == nullptr)
            throw py::value_error("aligned_with must be a HeightSource of open_dem()");
        settings.aligned_with = *aligned_with->dem;
    }
    const std::string name = path_text(path);
    return {value_or_raise(without_lock([&] { return ImageryRaster::open(name, settings); }))};
}

using Convert = void (Georeference::*)(std::span<const Eigen::Vector3d>,
                                       std::span<Eigen::Vector3d>) const;

// Positions of shape (n, 3) or (3,), in the same shape.
template <Convert convert>
Doubles convert_positions(const Georeference& georeference, const py::object& positions) {
    const Doubles from = read_doubles(positions, "positions");
    if (from.ndim() < 1 || from.ndim() > 2 || from.shape(from.ndim() - 1) != 3) {
        throw py::value_error("positions must have the shape (n, 3) or (3,), got " +
                              shape_text(from));
    }
    Doubles out(shape_of(from));
    const auto count = static_cast<std::size_t>(from.size() / 3);
    static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
    const auto* in = reinterpret_cast<const Eigen::Vector3d*>(from.data());
    auto* to = reinterpret_cast<Eigen::Vector3d*>(out.mutable_data());
    without_lock([&] { (georeference.*convert)({in, count}, {to, count}); });
    return out;
}

const char* name_of(HeightReference reference) {
    switch (reference) {
        case HeightReference::ellipsoidal:
            return "ellipsoidal";
        case HeightReference::orthometric:
            return "orthometric";
        case HeightReference::unknown:
            break;
    }
    return "unknown";
}

void bind_georeference(py::module_& module) {
    py::class_<Georeference>(
        module, "Georeference",
        R"(Where the world of a raster is on the Earth: HeightSource.georeference(). Any thread.

Positions are of shape (n, 3) or (3,): x, y, z in the world, metres; or longitude and latitude in WGS 84, degrees, and height,
above the ellipsoid if has_ellipsoidal_heights, else z; or coordinates of the raster's CRS and z. NaN without a counterpart.)")
        .def("lonlat_from_world", &convert_positions<&Georeference::lonlat_from_world>,
             py::arg("positions"), "Longitudes, latitudes and heights of world positions.")
        .def("world_from_lonlat", &convert_positions<&Georeference::world_from_lonlat>,
             py::arg("positions"), "World positions of longitudes, latitudes and heights.")
        .def("crs_from_world", &convert_positions<&Georeference::crs_from_world>,
             py::arg("positions"), "Coordinates in the raster's CRS of world positions.")
        .def("world_from_crs", &convert_positions<&Georeference::world_from_crs>,
             py::arg("positions"), "World positions of coordinates in the raster's CRS.")
        .def(
            "scale_at",
            [](const Georeference& georeference, double x, double y) {
                const PlaneScale scale = georeference.scale_at(x, y);
                return make_answer("PlaneScale", scale.x, scale.y, scale.convergence);
            },
            py::arg("x"), py::arg("y"), "The scale of the plane at a place: a PlaneScale.")
        .def(
            "geodesic_length",
            [](const Georeference& georeference, const py::object& a, const py::object& b) {
                return georeference.geodesic_length(read_vector(a, "a"), read_vector(b, "b"));
            },
            py::arg("a"), py::arg("b"),
            "Length of the geodesic between two world positions on the ellipsoid of WGS 84, "
            "metres.")
        .def_property_readonly(
            "height_reference",
            [](const Georeference& georeference) {
                return name_of(georeference.height_reference());
            },
            "What heights are measured from: \"ellipsoidal\", \"orthometric\" or \"unknown\".")
        .def_property_readonly("has_ellipsoidal_heights", &Georeference::has_ellipsoidal_heights,
                               "Whether heights are converted to the ellipsoid of WGS 84.")
        .def_property_readonly("heights", &Georeference::describe_heights,
                               "height_reference in words, with its source.");
}
#endif

#if TERRANE_PYTHON_STORE
py::object store_info(const StoreInfo& info) {
    return make_answer("StoreInfo", info.chunk_count, info.bytes, info.max_error_m, info.sha,
                       py::bytes(info.note));
}

Source open_store(const py::object& path) {
    const std::string name = path_text(path);
    StoreInfo info;
    auto source = without_lock([&] { return ChunkStore::open(name, &info); });
    Source made{value_or_raise(std::move(source)), store_info(info)};
    made.file = name;
    made.note = info.note;
    return made;
}

#if TERRANE_PYTHON_REMOTE
py::object http_statistics(const HttpStatistics& statistics) {
    const HttpFailures& f = statistics.failures;
    return make_answer("HttpStatistics", statistics.requests, statistics.bytes,
                       statistics.memory_hits, statistics.disk_hits, statistics.shared_blocks,
                       statistics.retries, statistics.cancelled, statistics.discarded,
                       statistics.damaged_blocks, statistics.cache_faults,
                       statistics.ignored_ranges,
                       make_answer("HttpFailures", f.refused, f.busy, f.server_error, f.cut_short,
                                   f.wrong_range, f.wrong_size, f.timed_out, f.unresolved,
                                   f.unreachable, f.certificate, f.redirect),
                       statistics.latency, statistics.bandwidth);
}

Source open_http_store(const std::string& url, const py::object& cache_folder,
                       std::uint64_t cache_bytes, std::size_t memory_bytes, std::size_t block_bytes,
                       std::size_t request_bytes, int connection_count, double connect_timeout,
                       double stall_timeout, double read_timeout, int retry_count,
                       double first_retry_delay, double longest_retry_delay, bool use_netrc,
                       const std::string& authorization, const py::object& certificate_file,
                       const std::string& user_agent, const std::string& s3_region,
                       const std::string& s3_endpoint, const std::string& s3_access_key,
                       const std::string& s3_secret_key, const std::string& s3_session_token) {
    const HttpSettings settings{.cache_folder = path_text(cache_folder),
                                .cache_bytes = cache_bytes,
                                .memory_bytes = memory_bytes,
                                .block_bytes = block_bytes,
                                .request_bytes = request_bytes,
                                .connection_count = connection_count,
                                .connect_timeout = connect_timeout,
                                .stall_timeout = stall_timeout,
                                .read_timeout = read_timeout,
                                .retry_count = retry_count,
                                .first_retry_delay = first_retry_delay,
                                .longest_retry_delay = longest_retry_delay,
                                .use_netrc = use_netrc,
                                .authorization = authorization,
                                .certificate_file = path_text(certificate_file),
                                .user_agent = user_agent,
                                .s3 = {.region = s3_region,
                                       .endpoint = s3_endpoint,
                                       .access_key = s3_access_key,
                                       .secret_key = s3_secret_key,
                                       .session_token = s3_session_token}};
    StoreInfo info;
    const std::shared_ptr<const HttpFiles> files =
        value_or_raise(without_lock([&] { return open_http(url, settings); }));
    auto source = without_lock([&] { return ChunkStore::open(files, &info); });
    Source made{value_or_raise(std::move(source)), store_info(info)};
    made.http_statistics = [files] { return http_statistics(files->statistics()); };
    made.note = info.note;
    return made;
}
#endif

using Region = std::optional<std::array<double, 4>>;

BakeSettings bake_settings(int level_count, const Region& region, int worker_count) {
    BakeSettings settings;
    settings.level_count = level_count;
    settings.worker_count = worker_count;
    if (region) settings.region = WorldRect{(*region)[0], (*region)[1], (*region)[2], (*region)[3]};
    return settings;
}

py::object bake(const Source& source, const py::object& path, int level_count, const Region& region,
                int worker_count, const py::bytes& note, const py::object& progress) {
    const Progress watched(progress);
    BakeSettings settings = bake_settings(level_count, region, worker_count);
    settings.note = std::string(note);
    settings.progress = watched.function();
    const std::string name = path_text(path);
    auto info = without_lock([&] { return ChunkStore::bake(*source.heights, name, settings); });
    watched.raise_pending();
    return store_info(value_or_raise(std::move(info)));
}

// A baker, with the source that it bakes.
struct HeldShardBaker {
    std::shared_ptr<const HeightSource> source;
    ShardBaker baker;
};

std::unique_ptr<HeldShardBaker> make_shard_baker(const Source& source, const py::object& folder,
                                                 int level_count, const Region& region,
                                                 int worker_count,
                                                 const std::optional<py::bytes>& note,
                                                 const std::optional<std::string>& fingerprint) {
    BakeSettings settings = bake_settings(level_count, region, worker_count);
    settings.note = note ? std::string(*note) : source.note;
    const std::string name = path_text(folder);
    auto baker = without_lock([&] {
        if (fingerprint) {
            settings.fingerprint = *fingerprint;
        } else if (!source.samples_hash.empty()) {
            settings.fingerprint = source.samples_hash;
        } else if (!source.file.empty()) {
            const auto hash = hash_of_file(source.file);
            if (hash) settings.fingerprint = hash->text();
        }
        return ShardBaker::create(*source.heights, name, settings);
    });
    return std::unique_ptr<HeldShardBaker>(
        new HeldShardBaker{source.heights, value_or_raise(std::move(baker))});
}

void bind_shard_baker(py::module_& module) {
    py::class_<HeldShardBaker>(
        module, "ShardBaker",
        R"(Bakes a source in pieces to a folder of files, which open_store() opens. Any thread.

Shards are baked in any order, by any number of processes and machines that share the folder and do not know of each other;
the files are the same, and those of `terrane bake --sharded`. A shard whose process was killed is baked again, a complete
one is not. python3 -m terrane.bake does all of it on Dask.)")
        .def(py::init(&make_shard_baker), py::arg("source"), py::arg("folder"), py::kw_only(),
             py::arg("level_count") = 0, py::arg("region") = py::none(),
             py::arg("worker_count") = 0, py::arg("note") = py::none(),
             py::arg("fingerprint") = py::none(),
             R"(Plans the shards, and writes the plan into the folder, which is made.

level_count   levels from the root squares on; 0: all
region        west, south, east, north, metres; None: everything
worker_count  threads of bake_shard(); 0: as many as the machine has
note          UTF-8 that is kept with it; None: the properties of a raster or store, such as its place on the Earth
fingerprint   text that differs if the source differs; None: DemInfo.samples_hash, or the hash of the file of a raster or
              store, else ""

Raises ValueError for a setting out of range, and for a folder with the plan of another source; OSError. Without the lock.)")
        .def_property_readonly(
            "shard_count", [](const HeldShardBaker& held) { return held.baker.shard_count(); },
            "Number of shards; they are numbered from 0.")
        .def(
            "is_baked",
            [](const HeldShardBaker& held, std::int64_t shard) {
                return without_lock([&] { return held.baker.is_baked(shard); });
            },
            py::arg("shard"), "Whether a shard is complete.")
        .def(
            "bake_shard",
            [](const HeldShardBaker& held, std::int64_t shard) {
                return value_or_raise(without_lock([&] { return held.baker.bake_shard(shard); }));
            },
            py::arg("shard"),
            R"(Bakes a shard, unless it is complete. Returns whether it was not.

Raises ValueError if there is no such shard, OSError where it cannot be written. Without the lock.)")
        .def(
            "verify_shard",
            [](const HeldShardBaker& held, std::int64_t shard, std::int64_t every) {
                return value_or_raise(
                    without_lock([&] { return held.baker.verify_shard(shard, every); }));
            },
            py::arg("shard"), py::arg("every") = 16,
            R"(Bakes one of `every` chunks and squares of a shard again, compares them, and returns their number.

Raises ValueError that names the first one that differs, OSError if the shard is not baked. Without the lock.)")
        .def_static(
            "combine",
            [](const py::object& folder) {
                const std::string name = path_text(folder);
                return store_info(
                    value_or_raise(without_lock([&] { return ShardBaker::combine(name); })));
            },
            py::arg("folder"),
            R"(Writes terrain.json of a folder whose shards are all baked, without their source. Returns a StoreInfo.

Raises ValueError that names the first shard that is missing or damaged, OSError. Without the lock.)");
}
#endif

#if TERRANE_PYTHON_REMOTE
void bind_http(py::module_& module) {
    const HttpSettings defaults;
    module.def(
        "open_http", &open_http_store, py::arg("url"), py::kw_only(), py::arg("cache_folder") = "",
        py::arg("cache_bytes") = defaults.cache_bytes,
        py::arg("memory_bytes") = defaults.memory_bytes,
        py::arg("block_bytes") = defaults.block_bytes,
        py::arg("request_bytes") = defaults.request_bytes,
        py::arg("connection_count") = defaults.connection_count,
        py::arg("connect_timeout") = defaults.connect_timeout,
        py::arg("stall_timeout") = defaults.stall_timeout,
        py::arg("read_timeout") = defaults.read_timeout,
        py::arg("retry_count") = defaults.retry_count,
        py::arg("first_retry_delay") = defaults.first_retry_delay,
        py::arg("longest_retry_delay") = defaults.longest_retry_delay,
        py::arg("use_netrc") = defaults.use_netrc, py::arg("authorization") = "",
        py::arg("certificate_file") = "", py::arg("user_agent") = defaults.user_agent,
        py::arg("s3_region") = defaults.s3.region, py::arg("s3_endpoint") = "",
        py::arg("s3_access_key") = "", py::arg("s3_secret_key") = "",
        py::arg("s3_session_token") = "",
        R"(Opens a baked terrain in shards on an HTTP server. Its chunks are read, and checked, when a Terrain wants them.

url                 of the folder, or of its terrain.json: http, https, or a bucket, s3://bucket/folder/
cache_folder        of the disk cache, which processes may share; "": none
cache_bytes         ceiling of the disk cache, 64 blocks or more
memory_bytes        ceiling of the blocks kept in memory
block_bytes         files are read in blocks of this size, a power of two
request_bytes       most bytes of neighbouring blocks in one request
connection_count    most requests at the same time, 1 to 64
connect_timeout     to resolve, connect and negotiate TLS, seconds
stall_timeout       a request that gets less than 1000 bytes/s for so many seconds is repeated
read_timeout        deadline of one read with all repetitions, seconds
retry_count         repetitions of a failed request, 0 to 100
first_retry_delay   seconds before the first repetition; doubled for each further one
longest_retry_delay limit of this delay, seconds
use_netrc           user and password from ~/.netrc
authorization       value of the header Authorization; "": none
certificate_file    PEM file of trusted certificates; "": those of the system
user_agent          value of the header User-Agent
s3_region           of a bucket
s3_endpoint         address of the bucket's server; "": Amazon's
s3_access_key       key with which requests to a bucket are signed; "": they are not
s3_secret_key       belongs to the key
s3_session_token    of temporary keys; "": none

Raises ValueError for a wrong address or setting, or where it is no store; OSError or TimeoutError where terrain.json cannot
be read. Without the lock.)");
}
#endif

}  // namespace

void bind_files(py::module_& module) {
    py::class_<HeldImagery>(module, "Imagery",
                            "Colours to drape over ground: the argument imagery of a Renderer.")
        .def_property_readonly(
            "rect",
            [](const HeldImagery& held) {
                const WorldRect rect = held.source->rect();
                return py::make_tuple(rect.west, rect.south, rect.east, rect.north);
            },
            "West, south, east and north of the rectangle with data, world, metres.")
        .def_property_readonly(
            "texel_size", [](const HeldImagery& held) { return held.source->texel_size(); },
            "Side of the finest texels, metres.");
#if TERRANE_PYTHON_DEM
    const ImageryRasterSettings imagery;
    module.def("open_imagery", &open_imagery, py::arg("path"), py::kw_only(),
               py::arg("aligned_with") = py::none(), py::arg("bands") = imagery.bands,
               py::arg("limits") = py::none(), py::arg("percentiles") = py::none(),
               py::arg("gamma") = imagery.gamma, py::arg("read_timeout") = imagery.read_timeout,
               R"(Opens a raster of colours, in any format that GDAL reads, as Imagery.

aligned_with  the HeightSource of open_dem() in whose world it is; None: world (0, 0) is the centre of the raster
bands         indices from 1 of red, green and blue, or of grey; empty: those that the file declares
limits        values displayed as black and as white
percentiles   the same as percentiles of each band, 0 to 100
gamma         above 1 the middle is brighter, 0.1 to 10
read_timeout  seconds, > 0

Raises OSError (cannot be read), ValueError (bad raster or setting), TimeoutError. Without the lock.)");
    bind_georeference(module);
    const DemSettings defaults;
    module.def(
        "open_dem", &open_dem, py::arg("path"), py::kw_only(),
        py::arg("finest_spacing") = defaults.finest_spacing,
        py::arg("spacing_tolerance") = defaults.spacing_tolerance,
        py::arg("detail_seed") = py::none(),
        py::arg("detail_roughness") = defaults.detail_roughness, py::arg("cache") = "none",
        py::arg("cache_folder") = "", py::arg("scan_file") = "",
        py::arg("height_unit") = defaults.height_unit,
        py::arg("height_scale") = defaults.height_scale, py::arg("nodata") = py::none(),
        py::arg("encoding") = "automatic", py::arg("cell") = defaults.cell,
        py::arg("projection") = "own", py::arg("crop") = py::none(),
        py::arg("memory_bytes") = defaults.memory_bytes,
        py::arg("read_timeout") = defaults.read_timeout, py::arg("progress") = py::none(),
        R"(Opens a raster of heights, in any format that GDAL reads. World (0, 0) is the centre of its outer edges.

finest_spacing   of the lattice, at most, metres; 0: the raster's cell
spacing_tolerance  over square cells the spacing may be longer by this factor, 1 to 2
detail_seed      adds fractal detail below the raster's resolution; None: none
detail_roughness amplitude of detail relative to the raster's own roughness, 0 to 100
cache            of the bounds: "none", "beside" the raster, or in a "folder"
cache_folder     that folder
scan_file        what an earlier opening found, read instead of all samples; written if absent. "": none
height_unit      of the numbers, such as "foot"; "": the file's
height_scale     factor of all heights, not 0; -1 for depths
nodata           numbers that are nodata besides those that the file declares; None: numbers such as -9999 are refused
encoding         "automatic", "numbers", "terrarium" or "mapbox"
cell             side of the cells of a raster without georeferencing, metres; 0: 1 m. Or of one that is resampled,
                 because it is rotated or projected; 0: its own
projection       "own", the plane of the raster's CRS, or "local", the tangent plane at its middle
crop             west, south, east and north of the part to open, in the raster's CRS; None: the whole raster
memory_bytes     limit of the memory of opening and of the source
read_timeout     seconds, > 0
progress         called with the share that is done, 0 to 1; returning False cancels. What it raises is raised here

Raises OSError (cannot be read), ValueError (bad raster or setting), MemoryError, TimeoutError. Without the lock.)");
#endif
#if TERRANE_PYTHON_STORE
    module.def("open_store", &open_store, py::arg("path"),
               R"(Opens a baked terrain: a file, the folder of one in shards, or its terrain.json.

Raises OSError where it cannot be read, ValueError where it is no store or damaged.)");
#if TERRANE_PYTHON_REMOTE
    bind_http(module);
#endif
    module.def(
        "bake", &bake, py::arg("source"), py::arg("path"), py::kw_only(),
        py::arg("level_count") = 0, py::arg("region") = py::none(), py::arg("worker_count") = 0,
        py::arg("note") = py::bytes(), py::arg("progress") = py::none(),
        R"(Makes all chunks of a source and writes them to a file, which appears when it is complete. Returns a StoreInfo.

level_count   levels from the root squares on; 0: all
region        west, south, east, north, metres; None: everything
worker_count  threads; 0: as many as the machine has
note          bytes that are kept with it
progress      as of open_dem(), on the calling thread

Raises ValueError for a setting out of range, OSError where it cannot be written. Without the lock.)");
    bind_shard_baker(module);
#endif
}

}  // namespace terrane::python
