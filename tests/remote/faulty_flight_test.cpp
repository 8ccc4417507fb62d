// SPDX-License-Identifier: MIT
// Flights in real time, with bodies, over a terrain whose server fails: at random, then always, then no more.
#include "remote_files.h"
#include "store/store_files.h"
#include "support/random.h"
#include "tls_server.h"

#include <terrane/collision/world.h>
#include <terrane/store/shard_baker.h>
#include <terrane/terrain/terrain.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <map>
#include <ostream>

namespace terrane::faulty_flight_test {

using namespace test;
using Kind = ServerFault::Kind;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kBodyCount = 50;
constexpr std::array kSides{-1.0, 0.0, 1.0};
constexpr double kSpeed = 250.0;  // of the camera, at least
constexpr double kFrame = 1.0 / 30.0,
                 kThrow = 4.0;  // seconds: of a frame; between throws of a body
constexpr double kLongestUpdate = 3.0, kLongestEnd = 20.0, kLongestRecovery = 60.0;  // hang limits

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

struct Case {
    const char* name;
    ServerFault fault;
    std::uint64_t HttpFailures::*kind;               // null: no failure of a request
    std::uint64_t HttpStatistics::*count = nullptr;  // then: what counts it
    bool is_each_counted = true;                     // whether each wrong reply is a failure
};

/// A socket that listens, whose connections nobody accepts.
class DeafServer {
public:
    explicit DeafServer(bool is_open = true)
        : handle_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof(address);
        EXPECT_EQ(bind(handle_, reinterpret_cast<const sockaddr*>(&address), size), 0);
        EXPECT_TRUE(!is_open || listen(handle_, 64) == 0);
        getsockname(handle_, reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
    }
    ~DeafServer() { close(handle_); }
    DeafServer(const DeafServer&) = delete;
    DeafServer& operator=(const DeafServer&) = delete;
    std::string address() const { return "127.0.0.1:" + std::to_string(port_) + "/"; }

private:
    int handle_, port_ = 0;
};

ServerFault redirect_to(const std::string& address) {
    return {Kind::status, 302, "Location: " + address + "\r\n"};
}

/// What a flight has found.
struct Outcome {
    HttpStatistics http;
    PagerStats paging;
    std::string last_failure;
    int frames = 0, late_frames = 0;
    int wrong_replies = 0;                                   // of the server
    double parked = 0.0;                                     // seconds of bodies
    double longest_update = 0.0, end = 0.0, recovery = 0.0;  // seconds
    std::uint64_t landed = 0;                                // impacts on the ground
    std::uint64_t compared_chunks = 0, wrong_chunks = 0;
    std::uint64_t compared_heights = 0, wrong_heights = 0;
    std::uint64_t compared_bodies = 0, fallen_bodies = 0;
    bool has_recovered = false;
};

/// A baked terrain of 4 km by 4 km or, for long flights, 16 km by 4 km, and all its chunks.
class BakedWorld {
public:
    BakedWorld() : root_count_(few_or_many(1, 4)) {
        const FractalSettings settings{.seed = 11,
                                       .octave_count = 9,
                                       .amplitude = 300.0,
                                       .wavelength_log2 = 11,
                                       .finest_spacing_log2 = 2,
                                       .root_size_log2 = 12,
                                       .first_root_x = 0,
                                       .first_root_y = 0,
                                       .root_count_x = root_count_,
                                       .root_count_y = 1};
        const auto source = FractalHeights::create(settings).value();
        const ShardBaker baker =
            ShardBaker::create(*source, folder_.file("store"), {.worker_count = 2}).value();
        for (std::int64_t i = 0; i < baker.shard_count(); ++i) {
            EXPECT_TRUE(baker.bake_shard(i).has_value());
        }
        EXPECT_TRUE(ShardBaker::combine(folder_.file("store")).has_value());
        source_ = open_store(folder_.file("store"));
        std::vector<std::shared_ptr<const Chunk>> chunks;
        for (const ChunkKey& key : all_keys(source_->lattice())) {
            chunks.push_back(make_chunk(*source_, key).value());
        }
        resident_ = std::make_shared<const ResidentSet>(source_->lattice(), source_->extent(),
                                                        std::move(chunks), 1);
    }

    double length() const { return 4096.0 * root_count_; }
    const ResidentSet& resident() const { return *resident_; }
    Ground ground() const { return Ground(resident_, source_->lattice().finest_level); }
    void put_files(HttpServer& server) const {
        std::vector<std::string> paths = files_in(folder_.file("store"), ".shard");
        paths.push_back(folder_.file("store/terrain.json"));
        for (const std::string& path : paths) {
            const std::vector<char> bytes = read_file(path);
            server.put(path.substr(path.rfind('/') + 1), {bytes.begin(), bytes.end()});
        }
    }

private:
    TemporaryFolder folder_;
    std::int32_t root_count_;
    std::shared_ptr<const HeightSource> source_;
    std::shared_ptr<const ResidentSet> resident_;
};

/// Fifty bodies that are thrown again and again onto ground ahead of the camera.
class ThrownBodies {
public:
    ThrownBodies(const BakedWorld& baked, std::uint64_t seed)
        : true_ground_(baked.ground()), length_(baked.length()), random_(seed) {
        for (std::size_t i = 0; i < kBodyCount; ++i) {
            const double size = random_.between(0.3, 1.5);
            Shape shape = Sphere{size};
            if (i % 3 == 1) shape = Box{{size, 0.7 * size, 0.5 * size}};
            if (i % 3 == 2) shape = Capsule{0.5 * size, size};
            bodies_.push_back(world_.add({.shape = shape}, placement(0.0, 0.0)).value());
        }
    }

    std::span<const BodyNeed> needs() { return world_.needs(); }

    /// Throws some bodies ahead of the camera at `x`, which flies towards larger x if `direction` is 1, else -1.
    void throw_some(int frame, double x, double direction) {
        const int period = static_cast<int>(kThrow / kFrame);
        for (std::size_t i = 0; i < kBodyCount; ++i) {
            if (static_cast<int>(i) * period / static_cast<int>(kBodyCount) != frame % period)
                continue;
            EXPECT_TRUE(world_.teleport(bodies_[i], placement(x, direction)).has_value());
        }
    }

    void step(const Ground& ground, Outcome& outcome) {
        const StepReport report = world_.step(ground, kFrame);
        outcome.parked += static_cast<double>(report.parked) * kFrame;
        outcome.landed += report.impacts;
        outcome.fallen_bodies += report.too_deep;
        for (const BodyId body : bodies_) {
            ++outcome.compared_bodies;
            if (has_fallen(body)) ++outcome.fallen_bodies;
            compare_heights(ground, world_.state(body).pose.translation, outcome);
        }
    }

private:
    double true_height(double x, double y) const {
        const HeightAnswer at = true_ground_.height(x, y);
        return at.status == QueryStatus::ok ? at.height : -1e9;
    }

    BodyPlacement placement(double x, double direction) {
        const double ahead = random_.between(50.0, 600.0), aside = random_.between(-1500.0, 1500.0);
        const WorldPos place{std::clamp(x + direction * ahead, 20.0, length_ - 20.0),
                             2048.0 + aside, 0};
        BodyPlacement made;
        made.pose.rotation = random_.rotation();
        // higher than the ground around it within 3 m, the largest body
        double top = -1e9;
        for (const double dx : kSides) {
            for (const double dy : kSides)
                top = std::max(top, true_height(place.x() + 3.0 * dx, place.y() + 3.0 * dy));
        }
        made.pose.translation = {place.x(), place.y(), top + random_.between(4.0, 8.0)};
        made.velocity = {direction * random_.between(20.0, 300.0), random_.between(-30.0, 30.0),
                         -20.0};
        return made;
    }

    /// Whether a body is below the true ground: its centre, or the ball in its middle by more than its tolerance.
    bool has_fallen(BodyId body) const {
        const WorldPos& centre = world_.state(body).pose.translation;
        const Shape& shape = world_.settings(body).shape;
        const auto* const sphere = std::get_if<Sphere>(&shape);
        const double radius = sphere != nullptr ? sphere->radius : 0.0;
        const double tolerance = default_contact_tolerance(shape) + 1e-6;
        for (const double side_x : kSides) {
            for (const double side_y : kSides) {
                const double dx = 0.6 * radius * side_x, dy = 0.6 * radius * side_y;
                const double low = centre.z() - std::sqrt(radius * radius - dx * dx - dy * dy);
                if (low + tolerance < true_height(centre.x() + dx, centre.y() + dy)) return true;
            }
        }
        return false;
    }

    void compare_heights(const Ground& ground, const WorldPos& place, Outcome& outcome) const {
        const HeightAnswer at = ground.height(place.x(), place.y());
        if (at.status != QueryStatus::ok) return;
        ++outcome.compared_heights;
        if (at.height != true_height(place.x(), place.y())) ++outcome.wrong_heights;
    }

    Ground true_ground_;
    double length_;
    Random random_;
    World world_ = World::create({}).value();
    std::vector<BodyId> bodies_;
};

/// Compares chunks that have arrived with those of the folder.
class ArrivedChunks {
public:
    explicit ArrivedChunks(const ResidentSet& wanted) : wanted_(wanted) {}
    void compare(const ResidentSet& resident, Outcome& outcome) {
        for (const ResidentChunk& chunk : resident.chunks()) {
            std::weak_ptr<const Chunk>& known =
                known_[{chunk->key.level, chunk->key.x, chunk->key.y}];
            if (known.lock().get() == chunk.get()) continue;
            known = static_cast<const std::shared_ptr<const Chunk>&>(chunk);
            ++outcome.compared_chunks;
            const Chunk* const wanted = wanted_.find_chunk(chunk->key);
            if (wanted == nullptr || !same_chunk(*chunk, *wanted)) ++outcome.wrong_chunks;
        }
    }

private:
    const ResidentSet& wanted_;
    std::map<std::array<std::int32_t, 3>, std::weak_ptr<const Chunk>> known_;
};

Outcome fly(const BakedWorld& baked, const Case& each, double seconds, std::uint64_t seed) {
    Outcome outcome;
    HttpServer server;
    baked.put_files(server);
    const TemporaryFolder cache;
    HttpSettings settings;  // otherwise as by default
    settings.cache_folder = cache.path();
    settings.memory_bytes = std::size_t{1} << 22;
    if (seconds < 10.0) {  // many requests within a short flight
        settings.stall_timeout = settings.connect_timeout = 0.5;
        settings.block_bytes = std::size_t{1} << 15;
        settings.request_bytes = std::size_t{1} << 17;
    }
    // The camera crosses the world once at least.
    const double way = baked.length() - 1000.0, speed = std::max(kSpeed, way / seconds);
    std::shared_ptr<const HttpFiles> files = open_files(server.url(), settings);
    ThrownBodies bodies(baked, seed);
    const Ground true_ground = baked.ground();
    {
        Terrain terrain =
            Terrain::create(ChunkStore::open(files).value(),
                            {.paging = {.memory_bytes = std::size_t{40} << 20, .worker_count = 4},
                             .meshes = {.triangle_budget = 20'000}})
                .value();
        ArrivedChunks arrived(baked.resident());
        const auto camera_at = [&](double time) {
            const double turn = std::fmod(speed * time, 2.0 * way);
            const double direction = turn < way ? 1.0 : -1.0;
            const double x = 500.0 + (direction > 0.0 ? turn : 2.0 * way - turn);
            const WorldPos eye{x, 2048.0, true_ground.height(x, 2048.0).height + 200.0};
            const Eigen::Vector3d ahead{direction * 500.0, 0.0, -150.0};
            return Camera{.view = look_at(eye, eye + ahead, 1.0, 640, 360).value(),
                          .velocity = {direction * speed, 0.0, 0.0}};
        };
        const auto update = [&](double time) -> const Frame& {
            const Camera camera = camera_at(time);
            const auto begin = Clock::now();
            const Frame& frame = terrain.update({camera}, bodies.needs(), time);
            outcome.longest_update = std::max(outcome.longest_update, seconds_since(begin));
            arrived.compare(*terrain.pager().resident(), outcome);
            return frame;
        };
        if (seconds > 10.0) terrain.load({camera_at(0.0)}, bodies.needs(), 0.0);
        const auto begin = Clock::now();
        double time = 0.0;
        for (int part = 0; part < 3; ++part) {
            server.fail_at_random(each.fault, part == 0 ? 0.3 : part == 1 ? 1.0 : 0.0, seed);
            for (; time < seconds * (part + 1) / 3.0; time += kFrame, ++outcome.frames) {
                std::this_thread::sleep_until(begin + std::chrono::duration<double>(time));
                const Camera camera = camera_at(time);
                bodies.throw_some(outcome.frames, camera.view.eye_world.x(),
                                  camera.velocity.x() / speed);
                const Frame& frame = update(time);
                outcome.late_frames += frame.late_chunks > 0 ? 1 : 0;
                bodies.step(frame.ground, outcome);
            }
        }
        // The camera rests: all that it needs arrives.
        const auto rest = Clock::now();
        while (!outcome.has_recovered && seconds_since(rest) < kLongestRecovery) {
            const Camera camera{.view = camera_at(time).view};
            const Frame& frame =
                terrain.update({camera}, bodies.needs(), time + seconds_since(rest));
            arrived.compare(*terrain.pager().resident(), outcome);
            bodies.step(frame.ground, outcome);
            outcome.has_recovered = frame.late_chunks == 0 && frame.groundless_bodies == 0;
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        outcome.recovery = seconds_since(rest);
        // The end, with faults again: requests that will not be answered.
        server.fail_at_random(each.fault, 1.0, seed);
        for (int i = 0; i < 10; ++i, time += kFrame) {
            const Camera camera = camera_at(time + 20.0);  // it jumps
            terrain.update({camera}, {}, time + kLongestRecovery);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        outcome.paging = terrain.pager().stats();
        outcome.last_failure = terrain.pager().last_failure();
        const auto end = Clock::now();
        { const Terrain ended = std::move(terrain); }
        outcome.end = seconds_since(end);
    }
    server.fail_at_random({}, 0.0, seed);
    outcome.wrong_replies = server.fault_count();
    if (each.is_each_counted) {
        // Each wrong reply is counted, or its request was stopped. A reply may be on its way.
        EXPECT_TRUE(holds_soon([&] {
            outcome.http = files->statistics();
            return outcome.http.failures.*each.kind + outcome.http.cancelled >=
                   static_cast<std::uint64_t>(outcome.wrong_replies);
        })) << each.name;
    }
    outcome.http = files->statistics();
    const auto end = Clock::now();
    files.reset();
    outcome.end += seconds_since(end);
    return outcome;
}

void check(const Case& each, const Outcome& outcome) {
    SCOPED_TRACE(each.name);
    const HttpStatistics& http = outcome.http;
    EXPECT_EQ(outcome.fallen_bodies, 0u);
    EXPECT_EQ(outcome.wrong_chunks, 0u);
    EXPECT_EQ(outcome.wrong_heights, 0u);
    EXPECT_GT(outcome.compared_chunks, 10u);
    EXPECT_GT(outcome.compared_heights, 100u);
    EXPECT_GT(outcome.landed, 0u);
    EXPECT_TRUE(outcome.has_recovered) << outcome.last_failure;
    EXPECT_LT(outcome.longest_update, kLongestUpdate);
    EXPECT_LT(outcome.end, kLongestEnd);
    EXPECT_GT(outcome.wrong_replies, 0);
    const HttpFailures& f = http.failures;
    SCOPED_TRACE("refused " + std::to_string(f.refused) + ", busy " + std::to_string(f.busy) +
                 ", server_error " + std::to_string(f.server_error) + ", cut_short " +
                 std::to_string(f.cut_short) + ", wrong_range " + std::to_string(f.wrong_range) +
                 ", wrong_size " + std::to_string(f.wrong_size) + ", timed_out " +
                 std::to_string(f.timed_out) + ", unresolved " + std::to_string(f.unresolved) +
                 ", unreachable " + std::to_string(f.unreachable) + ", certificate " +
                 std::to_string(f.certificate) + ", redirect " + std::to_string(f.redirect));
    if (each.kind == nullptr) {
        EXPECT_GT(http.*each.count, 0u);
        EXPECT_EQ(failure_count(f), f.timed_out);
    } else {
        EXPECT_GT(http.failures.*each.kind, 0u);
        // A loaded machine may be late.
        const std::uint64_t others = failure_count(f) - f.*each.kind;
        EXPECT_EQ(others, &(f.*each.kind) == &f.timed_out ? 0u : f.timed_out);
    }
    if (each.is_each_counted && &(f.*each.kind) != &f.timed_out) {
        EXPECT_LE(http.failures.*each.kind, static_cast<std::uint64_t>(outcome.wrong_replies));
    }
}

void print_head() {
    std::printf("%-14s %8s %8s %8s %9s %8s %8s %6s %8s %8s %7s %7s %6s %7s %7s\n", "fault",
                "replies", "counted", "retries", "cancelled", "discards", "requests", "loads",
                "late", "parked", "update", "recov.", "end", "falls", "wrong");
    std::printf("%-14s %8s %8s %8s %9s %8s %8s %6s %8s %8s %7s %7s %6s %7s %7s\n", "", "wrong", "",
                "", "", "", "", "failed", "frames", "body s", "ms", "s", "s", "", "chunks");
}

void print_row(const Case& each, const Outcome& o) {
    std::printf(
        "%-14s %8d %8llu %8llu %9llu %8llu %8llu %6llu %3d/%4d %8.1f %7.1f %7.2f %6.2f %7llu "
        "%3llu/%3llu\n",
        each.name, o.wrong_replies,
        static_cast<unsigned long long>(each.kind != nullptr ? o.http.failures.*each.kind
                                                             : o.http.*each.count),
        static_cast<unsigned long long>(o.http.retries),
        static_cast<unsigned long long>(o.http.cancelled),
        static_cast<unsigned long long>(o.http.discarded),
        static_cast<unsigned long long>(o.http.requests),
        static_cast<unsigned long long>(o.paging.failed), o.late_frames, o.frames, o.parked,
        1000.0 * o.longest_update, o.recovery, o.end,
        static_cast<unsigned long long>(o.fallen_bodies),
        static_cast<unsigned long long>(o.wrong_chunks),
        static_cast<unsigned long long>(o.compared_chunks));
}

// The short form has three faults, and 1.2 s for each; the long one all of them, and a minute.
TEST(FaultyFlights, NeitherFallNorShowWrongHeightsNorWait) {
    setenv("no_proxy", "127.0.0.1,localhost,no-such-host.invalid", 1);
    const bool is_long = few_or_many(0, 1) != 0;
    const double seconds = number_from("TERRANE_FLIGHT_SECONDS", is_long ? 60.0 : 1.2);
    const auto seed = number_from<std::uint64_t>("TERRANE_SEED", 20261201);
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BakedWorld baked;
    const DeafServer deaf, closed(false);
    TlsServer untrusted;
    std::vector<Case> cases{
        {"503", {Kind::status, 503, "Retry-After: 1\r\n"}, &HttpFailures::busy},
        {"hang", {Kind::hang, 0, ""}, &HttpFailures::timed_out},
        {"wrong bytes", {Kind::wrong_bytes, 0, ""}, nullptr, &HttpStatistics::discarded, false},
    };
    if (is_long) {
        cases.insert(
            cases.end(),
            {{"404", {Kind::status, 404, ""}, &HttpFailures::refused},
             {"403", {Kind::status, 403, ""}, &HttpFailures::refused},
             {"500", {Kind::status, 500, ""}, &HttpFailures::server_error},
             {"429", {Kind::status, 429, "Retry-After: 2\r\n"}, &HttpFailures::busy},
             {"cut short", {Kind::cut_short, 0, ""}, &HttpFailures::cut_short},
             // libcurl itself repeats a request on an old connection that the server closes.
             {"dropped", {Kind::drop, 0, ""}, &HttpFailures::cut_short, nullptr, false},
             {"no HTTP", {Kind::garbage, 0, ""}, &HttpFailures::cut_short},
             {"drip", {Kind::drip, 0, ""}, &HttpFailures::timed_out},
             {"range ignored",
              {Kind::ignore_range, 0, ""},
              nullptr,
              &HttpStatistics::ignored_ranges,
              false},
             {"wrong range", {Kind::wrong_range, 0, ""}, &HttpFailures::wrong_range},
             {"gzip", {Kind::encoded, 0, ""}, &HttpFailures::wrong_range},
             {"changed file", {Kind::other_file, 0, ""}, &HttpFailures::wrong_size},
             {"unresolved", redirect_to("http://no-such-host.invalid/"), &HttpFailures::unresolved},
             {"unreachable", redirect_to("http://" + closed.address()), &HttpFailures::unreachable},
             {"hanging TLS", redirect_to("https://" + deaf.address()), &HttpFailures::timed_out},
             {"redirect loop", redirect_to("?again"), &HttpFailures::redirect, nullptr, false}});
        if (untrusted.make_certificate("localhost")) {
            cases.push_back({"certificate", redirect_to(untrusted.serve("localhost", "-WWW")),
                             &HttpFailures::certificate});
        } else {
            std::printf("the program openssl was not found: no flight with a wrong certificate\n");
        }
    }
    std::vector<Outcome> outcomes(cases.size());
    const std::size_t at_once = number_from<std::size_t>("TERRANE_FLIGHTS", is_long ? 4 : 3);
    print_head();
    for (std::size_t first = 0; first < cases.size(); first += at_once) {
        std::vector<std::jthread> flights;
        for (std::size_t i = first; i < std::min(first + at_once, cases.size()); ++i) {
            flights.emplace_back([&, i] { outcomes[i] = fly(baked, cases[i], seconds, seed + i); });
        }
        flights.clear();
        for (std::size_t i = first; i < std::min(first + at_once, cases.size()); ++i) {
            print_row(cases[i], outcomes[i]);
            std::fflush(stdout);
        }
    }
    for (std::size_t i = 0; i < cases.size(); ++i) check(cases[i], outcomes[i]);
}

// Requests for chunks that were only expected end with the terrain too.
TEST(FaultyFlights, LeaveNoRequests) {
    setenv("no_proxy", "127.0.0.1,localhost", 1);
    const BakedWorld baked;
    HttpServer server;
    baked.put_files(server);
    HttpSettings settings;
    settings.stall_timeout = settings.read_timeout = 3600.0;
    settings.block_bytes = settings.request_bytes = std::size_t{1} << 14;
    const auto files = open_files(server.url(), settings);
    const auto source = ChunkStore::open(files).value();
    std::uint64_t complete = 0;
    {
        Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 1}}).value();
        const RequiredRegion region = terrain.require(source->extent(), 0.0);
        double time = 0.0;
        const auto update_until = [&](const auto& condition) {
            return holds_soon([&] {
                terrain.update({}, {}, time += 0.1);
                return condition();
            });
        };
        EXPECT_TRUE(update_until([&] { return terrain.pager().stats().loaded > 10; }));
        server.hold();
        complete = server.requests().size();
        EXPECT_TRUE(update_until([&] { return server.requests().size() >= complete + 4; }));
    }
    EXPECT_TRUE(holds_soon([&] { return server.aborted_count() >= 4; }));
    EXPECT_EQ(failure_count(files->statistics().failures), 0u);
}

}  // namespace terrane::faulty_flight_test
