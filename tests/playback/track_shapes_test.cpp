// SPDX-License-Identifier: MIT
// Paths along tracks of many kinds, as receivers record them, compared with the polyline through their fixes.
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/playback/camera_path.h>

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace track_shapes_test {

// Where something is at a time in seconds, as an offset from its start in metres.
using Motion = std::function<WorldPos(double)>;

// Legs at constant speeds, with a wait at the end of each.
class Route {
public:
    void go(const WorldPos& offset, double speed, double wait = 0.0) {
        const WorldPos place = places_.back() + offset;
        times_.push_back(times_.back() + std::max(offset.norm() / speed, 1e-3));
        places_.push_back(place);
        times_.push_back(times_.back() + wait + 1e-3);
        places_.push_back(place);
    }
    WorldPos at(double time) const {
        const auto after = std::upper_bound(times_.begin(), times_.end(), time);
        if (after == times_.end()) return places_.back();
        const auto i = static_cast<std::size_t>(after - times_.begin());
        const double t = (time - times_[i - 1]) / (times_[i] - times_[i - 1]);
        return (1.0 - t) * places_[i - 1] + t * places_[i];
    }
    double duration() const { return times_.back(); }

private:
    std::vector<double> times_{0.0};
    std::vector<WorldPos> places_{WorldPos::Zero()};
};

// The legs that `add_legs(route, i)` adds for i = 0, 1, ..., until they last long enough for every recording.
constexpr int kFixes = 90;
Motion route(double interval, const std::function<void(Route&, int)>& add_legs) {
    Route legs;
    for (int i = 0; legs.duration() < 8.0 * kFixes * interval; ++i) add_legs(legs, i);
    return [legs](double time) { return legs.at(time); };
}

struct Steering {
    double speed = 0.0;  // m/s
    double turn = 0.0;   // rad/s
    double climb = 0.0;  // m/s
};

// A vehicle that is steered by a function of time.
Motion steered(double interval, const std::function<Steering(double)>& steering) {
    Route legs;
    const double step = 0.5 * interval;
    double heading = 0.3;
    while (legs.duration() < 8.0 * kFixes * interval) {
        const Steering now = steering(legs.duration());
        heading += now.turn * step;
        const WorldPos velocity(now.speed * std::cos(heading), now.speed * std::sin(heading),
                                now.climb);
        legs.go(velocity * step, std::max(velocity.norm(), 1e-3));
    }
    return [legs](double time) { return legs.at(time); };
}

struct Kind {
    std::string name;
    double interval = 1.0;  // between fixes, seconds
    double noise = 1.0;     // of the receiver, metres
    Motion motion;
};

// Whether a time is in the first `share` of its period.
bool is_in(double time, double period, double share) {
    return std::fmod(time, period) < share * period;
}

WorldPos circle(double radius, double angle) {
    return {radius * std::cos(angle), radius * std::sin(angle), 0.0};
}

std::vector<Kind> aircraft() {
    return {
        {"a glider in thermals", 1.0, 2.0,
         steered(
             1.0,
             [](double t) {
                 return is_in(t, 90.0, 0.6) ? Steering{28.0, 0.29, 2.0} : Steering{45.0, 0.0, -1.5};
             })},
        {"a paraglider with a fix in 4 s", 4.0, 3.0,
         steered(4.0,
                 [](double t) {
                     return is_in(t, 400.0, 0.7) ? Steering{10.0, 0.35, 1.5}
                                                 : Steering{12.0, 0.01, -1.0};
                 })},
        {"loops", 0.2, 0.5,
         [](double t) {
             return WorldPos(12.0 * t + 90.0 * std::sin(0.5 * t), 3.0 * t,
                             90.0 - 90.0 * std::cos(0.5 * t));
         }},
        {"rolls and spins", 0.1, 0.2,
         steered(
             0.1,
             [](double t) {
                 return is_in(t, 8.0, 0.5) ? Steering{15.0, 2.6, -20.0} : Steering{90.0, 0.1, 20.0};
             })},
        {"an airliner with a fix a minute", 60.0, 30.0,
         steered(60.0,
                 [](double t) {
                     return Steering{250.0, is_in(t, 1500.0, 0.2) ? 0.004 : 0.0,
                                     t < 1200.0 ? 8.0 : 0.0};
                 })},
        {"an airliner with a fix an hour", 3600.0, 100.0,
         [](double t) { return WorldPos(circle(4e6, 240.0 * t / 4e6) - circle(4e6, 0.0)); }},
        {"a flight over the pole", 30.0, 20.0,
         [](double t) { return WorldPos(-2e5 + 240.0 * t, 5e4 * std::sin(240.0 * t / 3e5), 0.0); }},
        {"a holding pattern", 5.0, 5.0,
         steered(5.0,
                 [](double t) {
                     return Steering{110.0, is_in(t, 120.0, 0.5) ? 0.0524 : 0.0, 0.0};
                 })},
        {"a helicopter that hovers and descends", 1.0, 1.0,
         route(1.0,
               [](Route& r, int i) {
                   r.go({i % 2 == 0 ? 1500.0 : -1500.0, 200.0, 150.0}, 55.0, 40.0);
                   r.go({0.0, 0.0, -100.0}, 4.0, 20.0);
               })},
        {"a hovering drone", 0.2, 0.3, [](double) { return WorldPos::Zero().eval(); }},
        {"a drone's survey in lines", 1.0, 0.5,
         route(1.0,
               [](Route& r, int i) {
                   r.go({i % 2 == 0 ? 200.0 : -200.0, 0.0, 0.0}, 10.0, 1.0);
                   r.go({0.0, 25.0, 0.0}, 4.0, 1.0);
               })},
        {"a racing drone at 100 Hz", 0.01, 0.02,
         steered(0.01,
                 [](double t) {
                     return Steering{35.0, 6.0 * std::sin(5.0 * t), 10.0 * std::sin(3.0 * t)};
                 })},
        {"a balloon", 10.0, 3.0,
         [](double t) {
             return WorldPos(3.0 * t + 200.0 * std::sin(t / 300.0), 500.0 * std::sin(t / 700.0),
                             150.0 + 150.0 * std::sin(t / 200.0));
         }},
        {"a parachutist", 1.0, 4.0,
         route(1.0,
               [](Route& r, int i) {
                   if (i == 0) r.go({6000.0, 0.0, 3500.0}, 70.0);
                   r.go({200.0, 0.0, -2500.0}, 55.0);
                   for (int k = 0; k < 30; ++k)
                       r.go(circle(20.0, 0.8 * k) - WorldPos(0, 0, 12), 12.0);
                   r.go({0.0, 5.0, 0.0}, 1.0, 120.0);
                   r.go({500.0, 0.0, 2860.0}, 60.0);
               })},
        {"a rocket", 0.5, 5.0, [](double t) { return WorldPos(0.5 * t * t, 0.0, 3.0 * t * t); }},
        {"a satellite", 60.0, 50.0,
         [](double t) { return WorldPos(circle(6.8e6, 0.00113 * t) - circle(6.8e6, 0.0)); }},
    };
}

std::vector<Kind> vehicles() {
    return {
        {"a bicycle on switchbacks", 1.0, 3.0,
         route(1.0,
               [](Route& r, int i) {
                   r.go({i % 2 == 0 ? 150.0 : -150.0, 15.0, 12.0}, i % 6 < 3 ? 3.0 : 14.0);
               })},
        {"a racing car's laps at 10 Hz", 0.1, 0.3,
         steered(0.1,
                 [](double t) {
                     return Steering{50.0 + 30.0 * std::sin(0.4 * t),
                                     is_in(t, 12.0, 0.3) ? 0.9 : -0.1, 0};
                 })},
        {"a tram with stops", 1.0, 5.0,
         route(1.0,
               [](Route& r, int i) {
                   r.go({300.0, i % 3 == 0 ? 200.0 : 0.0, 0.0}, 11.0, 25.0);
               })},
        {"a train", 10.0, 8.0,
         steered(10.0,
                 [](double t) {
                     return Steering{83.0, 1e-3 * std::sin(t / 200.0), 0.5 * std::sin(t / 90.0)};
                 })},
        {"a bus between towers", 1.0, 20.0,
         route(1.0,
               [](Route& r, int i) {
                   r.go(i % 2 == 0 ? WorldPos(120, 0, 0) : WorldPos(0, 80, 0), 9.0, 6.0);
               })},
        {"city blocks", 3.0, 4.0,
         route(3.0,
               [](Route& r, int i) {
                   const std::array<WorldPos, 4> turns{WorldPos(90, 0, 0), WorldPos(0, 90, 0),
                                                       WorldPos(180, 0, 0), WorldPos(0, -90, 0)};
                   r.go(turns[static_cast<std::size_t>(i % 4)], 12.0);
               })},
        {"turns by 180 degrees", 2.0, 2.0,
         route(2.0,
               [](Route& r, int i) {
                   r.go({i % 2 == 0 ? 70.0 : -70.0, 0.0, 0.0}, 7.0);
               })},
        {"a ferry", 10.0, 8.0,
         route(10.0,
               [](Route& r, int i) {
                   r.go({i % 2 == 0 ? 4000.0 : -4000.0, 300.0, 0.0}, 8.0, 900.0);
               })},
        {"a ship with a fix in 10 minutes", 600.0, 15.0,
         steered(600.0,
                 [](double t) {
                     return Steering{10.0, 2e-5 * std::sin(t / 20'000.0), 0.0};
                 })},
        {"a sailing boat that tacks", 5.0, 3.0,
         route(5.0,
               [](Route& r, int i) {
                   r.go({400.0, i % 2 == 0 ? 400.0 : -400.0, 0.0}, 4.0);
               })},
        {"a mower in a garden of 10 m", 1.0, 0.1,
         route(1.0,
               [](Route& r, int i) {
                   r.go({i % 2 == 0 ? 10.0 : -10.0, 0.4, 0.0}, 0.5);
               })},
        {"an excavator", 1.0, 0.5,
         route(1.0,
               [](Route& r, int i) { r.go(circle(4.0, 2.4 * i), 1.5, i % 5 == 0 ? 60.0 : 2.0); })},
        {"one long straight", 1.0, 0.0, [](double t) { return WorldPos(30.0 * t, 40.0 * t, 0); }},
        {"a road through tunnels", 1.0, 5.0,
         steered(1.0,
                 [](double t) {
                     return Steering{30.0, 0.01 * std::sin(t / 17.0), std::sin(t / 30.0)};
                 })},
        {"a lift in a tower", 1.0, 0.5,
         route(1.0,
               [](Route& r, int i) {
                   r.go({0.0, 0.0, i % 2 == 0 ? 200.0 : -200.0}, 8.0, 30.0);
               })},
    };
}

std::vector<Kind> people_and_animals() {
    return {
        {"a hiker who rests", 5.0, 6.0,
         route(5.0,
               [](Route& r, int i) {
                   r.go({60.0, 40.0 * std::sin(1.7 * i), 8.0}, 1.2, i % 4 == 3 ? 600.0 : 0.0);
               })},
        {"a skier on lifts and slopes", 1.0, 3.0,
         route(1.0,
               [](Route& r, int) {
                   r.go({-1200.0, 0.0, 400.0}, 5.0, 30.0);
                   for (int k = 0; k < 20; ++k)
                       r.go({60.0, k % 2 == 0 ? 25.0 : -25.0, -20.0}, 14.0);
               })},
        {"a runner on a track of 400 m", 1.0, 2.0,
         steered(1.0,
                 [](double t) {
                     return Steering{5.0, is_in(t, 40.0, 0.58) ? 0.137 : 0.0, 0.0};
                 })},
        {"a watch at 1 Hz", 1.0, 4.0,
         steered(1.0,
                 [](double t) {
                     return Steering{3.0, 0.3 * std::sin(t / 11.0), 0.2 * std::sin(t / 40.0)};
                 })},
        {"a shopper indoors", 2.0, 15.0,
         route(2.0,
               [](Route& r, int i) { r.go(circle(12.0, 2.1 * i), 1.0, i % 3 == 0 ? 90.0 : 0.0); })},
        {"a collar with a fix an hour", 3600.0, 20.0,
         route(3600.0,
               [](Route& r, int i) {
                   r.go(circle(i % 4 < 2 ? 3000.0 : 40.0, 2.4 * i), 0.6, 9000.0);
               })},
        {"a bird that rests at night", 1800.0, 20.0,
         route(1800.0,
               [](Route& r, int) {
                   r.go({4e5, 1e5, 0.0}, 14.0, 40'000.0);
               })},
        {"figures of eight", 1.0, 1.0,
         [](double t) {
             return WorldPos(80.0 * std::sin(0.2 * t), 40.0 * std::sin(0.4 * t), 0.0);
         }},
        {"a spiral that widens", 1.0, 1.0, [](double t) { return circle(0.5 * t, 0.4 * t); }},
    };
}

// Steps between fixes whose lengths are drawn from a distribution.
std::vector<Kind> random_walks() {
    std::vector<Kind> kinds;
    const auto add = [&](const std::string& name, double interval, double noise,
                         const std::function<double(test::Random&)>& length) {
        test::Random random(1'000 + kinds.size());
        kinds.push_back({name, interval, noise, route(interval, [&](Route& r, int) {
                             const double step = length(random);
                             WorldPos offset = step * random.direction();
                             offset.z() = std::clamp(0.02 * offset.z(), -20.0, 20.0);
                             r.go(offset, std::max(offset.norm(), 1e-3) / interval);
                         })});
    };
    add("a random walk of 1 m", 1.0, 0.2, [](test::Random&) { return 1.0; });
    add("a random walk of 300 m", 20.0, 5.0, [](test::Random&) { return 300.0; });
    add("a random walk of 50 km", 600.0, 20.0, [](test::Random&) { return 5e4; });
    add("Brownian motion", 1.0, 1.0, [](test::Random& random) {
        return 20.0 * (random.between(0.0, 1.0) + random.between(0.0, 1.0));
    });
    add("a Levy flight", 2.0, 1.0,
        [](test::Random& random) { return std::pow(random.between(1e-4, 1.0), -1.0); });
    return kinds;
}

// How fixes are taken.
enum class Receiver { regular, jittered, dropping, faulty };

struct Fix {
    double time = 0.0;
    WorldPos place;
};

std::vector<Fix> record(const Kind& kind, Receiver receiver, test::Random& random) {
    std::vector<Fix> fixes;
    double time = 0.0;
    for (int i = 0; i < kFixes; ++i) {
        WorldPos place = WorldPos(0.0, 2e4, 3000.0) + kind.motion(time);
        double wait = kind.interval;
        if (receiver != Receiver::regular) {
            place += random.between(0.0, kind.noise) * random.direction();
        }
        if (receiver == Receiver::jittered) wait *= random.between(0.2, 1.8);
        if (receiver == Receiver::dropping && random.below(10) == 0) {
            wait *= random.between(2.0, 60.0);
        }
        if (receiver == Receiver::faulty) {
            const int fault = random.below(20);
            if (fault < 2) place.head<2>() += 60.0 * kind.noise * random.direction().head<2>();
            if (fault >= 2 && fault < 6 && i > 0) place = fixes.back().place;
            if (fault == 6) wait *= 1e-3;
            if (fault == 7) wait = 0.0;
        }
        fixes.push_back({time, place});
        time += wait;
    }
    return fixes;
}

// A file of fixes in one of the formats, and what it holds.
struct Shape {
    std::string name;
    std::string file;  // name of the file
    std::string text;
    std::vector<Fix> fixes;
    bool is_dropping = false;    // whether fixes without a height are among them
    double rounding = 1e-3;      // of places in the file, metres
    std::size_t heightless = 0;  // fixes without a height
};

std::string format(const char* pattern, auto... values) {
    std::array<char, 256> text{};
    const int size = std::snprintf(text.data(), text.size(), pattern, values...);
    return {text.data(), static_cast<std::size_t>(size)};
}

constexpr double kDegree = 111'000.0;  // metres, of longitude and latitude
constexpr int kStart = 10 * 3600;      // time of day of the first fix, seconds

void write_gpx(Shape& shape) {
    shape.file = "shape.gpx";
    shape.text = "<gpx><trk><trkseg>\n";
    for (std::size_t i = 0; i < shape.fixes.size(); ++i) {
        const auto& [time, p] = shape.fixes[i];
        const bool has_height = !shape.is_dropping || i % 6 != 0;
        shape.heightless += has_height ? 0 : 1;
        const long ms = std::lround(1e3 * time) + 1000L * kStart, second = ms / 1000;
        shape.text +=
            format("<trkpt lat=\"%.10f\" lon=\"%.10f\">", p.y() / kDegree, p.x() / kDegree);
        if (has_height) shape.text += format("<ele>%.4f</ele>", p.z());
        shape.text += format("<time>2024-05-%02ldT%02ld:%02ld:%02ld.%03ldZ</time></trkpt>\n",
                             1 + second / 86'400, second / 3600 % 24, second / 60 % 60, second % 60,
                             ms % 1000);
    }
    shape.text += "</trkseg></trk></gpx>\n";
}

void write_igc(Shape& shape) {
    shape.file = "shape.igc";
    shape.rounding = 1.5;
    const auto angle = [](double metres, const char* pattern, char positive, char negative) {
        const long thousandths = std::lround(60'000.0 * std::abs(metres) / kDegree);
        return format(pattern, thousandths / 60'000, thousandths % 60'000,
                      metres < 0.0 ? negative : positive);
    };
    for (std::size_t i = 0; i < shape.fixes.size(); ++i) {
        const auto& [time, p] = shape.fixes[i];
        const bool has_height = !shape.is_dropping || i % 7 != 0;
        shape.heightless += has_height ? 0 : 1;
        const long second = std::lround(time) + kStart, height = std::lround(p.z());
        shape.text +=
            format("B%02ld%02ld%02ld", second / 3600 % 24, second / 60 % 60, second % 60) +
            angle(p.y(), "%02ld%05ld%c", 'N', 'S') + angle(p.x(), "%03ld%05ld%c", 'E', 'W') +
            format("%c%05ld%05ld\n", has_height ? 'A' : 'V', height - 50, has_height ? height : 0);
    }
}

void write_numbers(Shape& shape, bool is_csv) {
    shape.file = is_csv ? "shape.csv" : "shape.tum";
    if (is_csv) shape.text = "time_s,x_m,y_m,z_m\n";
    const char* pattern = is_csv ? "%.17g,%.17g,%.17g,%s\n" : "%.17g %.17g %.17g %s 0 0 0 1\n";
    for (std::size_t i = 0; i < shape.fixes.size(); ++i) {
        const auto& [time, p] = shape.fixes[i];
        const bool has_height = !is_csv || !shape.is_dropping || i % 6 != 0;
        shape.heightless += has_height ? 0 : 1;
        const std::string height = has_height ? format("%.17g", p.z()) : "nan";
        shape.text += format(pattern, 1.7e9 + time, p.x(), p.y(), height.c_str());
    }
}

bool fits_igc(const std::vector<Fix>& fixes) {
    for (std::size_t i = 0; i < fixes.size(); ++i) {
        if (fixes[i].place.z() > 99'000.0 || std::abs(fixes[i].place.x()) > 179.0 * kDegree)
            return false;
        if (i > 0 && fixes[i].time - fixes[i - 1].time > 40'000.0) return false;
    }
    return true;
}

std::vector<Shape> shapes() {
    std::vector<Kind> kinds;
    for (auto& some : {aircraft(), vehicles(), people_and_animals(), random_walks()})
        kinds.insert(kinds.end(), some.begin(), some.end());
    constexpr std::array<const char*, 4> kReceivers{"regular", "jittered", "dropping", "faulty"};
    std::vector<Shape> all;
    for (std::size_t k = 0; k < kinds.size(); ++k) {
        for (std::size_t r = 0; r < kReceivers.size(); ++r) {
            test::Random random(100 * k + r);
            Shape shape;
            shape.name = kinds[k].name + ", " + kReceivers[r];
            shape.fixes = record(kinds[k], static_cast<Receiver>(r), random);
            shape.is_dropping = r == 2;
            const std::size_t file = (k + r) % 4;
            if (file < 2) {
                write_numbers(shape, file == 0);
            } else if (file == 2 && fits_igc(shape.fixes)) {
                write_igc(shape);
            } else {
                write_gpx(shape);
            }
            all.push_back(std::move(shape));
        }
    }
    return all;
}

Track read(const Shape& shape) {
    const std::string path =
        testing::TempDir() + "track_shapes_" + std::to_string(getpid()) + "_" + shape.file;
    std::ofstream(path, std::ios::binary) << shape.text;
    const TrackReference reference{.world_from_lonlat = [](const Eigen::Vector3d& p) {
        return WorldPos(p.x() * kDegree, p.y() * kDegree, p.z());
    }};
    Result<Track> track = read_track(path, reference);
    EXPECT_TRUE(track) << track.error().message;
    return track.value_or(Track{});
}

// The polyline through the points of a track, with uniform motion between two points.
class Polyline {
public:
    explicit Polyline(const Track& track) {
        for (const TrackPoint& point : track.points) {
            times_.push_back(point.time);
            places_.push_back(point.position_world);
        }
    }
    std::size_t segments() const { return times_.size() - 1; }
    double time(std::size_t i) const { return times_[i]; }
    const WorldPos& place(std::size_t i) const { return places_[i]; }
    double span(std::size_t i) const { return times_[i + 1] - times_[i]; }
    double length(std::size_t i) const { return (places_[i + 1] - places_[i]).norm(); }
    double longest() const {
        double most = 0.0;
        for (std::size_t i = 0; i < segments(); ++i) most = std::max(most, length(i));
        return most;
    }
    double whole_length() const {
        double sum = 0.0;
        for (std::size_t i = 0; i < segments(); ++i) sum += length(i);
        return sum;
    }
    double size() const {
        double most = 0.0;
        for (const WorldPos& p : places_) most = std::max(most, p.norm());
        return most;
    }
    WorldPos at(std::size_t segment, double t) const {
        const double share = (t - times_[segment]) / span(segment);
        return places_[segment] + share * (places_[segment + 1] - places_[segment]);
    }
    // Calls `take` with the segments that meet a range of times, and the seconds that they share.
    template <class Take>
    void for_each(double from, double to, const Take& take) const {
        const auto first = std::lower_bound(times_.begin() + 1, times_.end() - 1, from);
        for (auto i = static_cast<std::size_t>(first - times_.begin()) - 1;
             i < segments() && times_[i] <= to; ++i) {
            take(i, std::max(0.0, std::min(to, times_[i + 1]) - std::max(from, times_[i])));
        }
    }
    double fastest(double from, double to) const {
        double most = 0.0;
        for_each(from, to,
                 [&](std::size_t i, double) { most = std::max(most, length(i) / span(i)); });
        return most;
    }
    double covered(double from, double to) const {
        double sum = 0.0;
        for_each(from, to,
                 [&](std::size_t i, double shared) { sum += shared * length(i) / span(i); });
        return sum;
    }
    // The distance of a place from the nearest of all segments.
    double distance(const WorldPos& p) const {
        double least = (p - places_.back()).norm();
        for (std::size_t i = 0; i < segments(); ++i) {
            const Eigen::Vector3d chord = places_[i + 1] - places_[i], to_p = p - places_[i];
            const double square = chord.squaredNorm();
            const double t = square > 0.0 ? std::clamp(to_p.dot(chord) / square, 0.0, 1.0) : 0.0;
            least = std::min(least, (to_p - t * chord).norm());
        }
        return least;
    }

private:
    std::vector<double> times_;
    std::vector<WorldPos> places_;
};

// Below all tracks, so that none is lifted.
const test::WaveHeights& low_ground() {
    static const test::WaveHeights source(test::small_world(3, 8.0), 100.0, 2000.0);
    return source;
}

// The part of a path from `start` seconds after the track's start; its times are counted from there.
CameraPath follow(const Track& track, const CameraPathSettings& settings) {
    Result<CameraPath> path = CameraPath::create(track, low_ground(), settings);
    EXPECT_TRUE(path) << path.error().message;
    return std::move(*path);
}

// Starts and durations of the parts that are checked: all of a short track; of a long one both ends, and what is around
// some fixes and between some.
std::vector<std::pair<double, double>> parts_of(const Polyline& line) {
    constexpr double kWhole = 1000.0, kPart = 80.0;
    const double end = line.time(line.segments());
    if (end <= kWhole) return {{0.0, end}};
    std::vector<std::pair<double, double>> parts{{0.0, kPart}, {end - kPart, kPart}};
    for (std::size_t i = 3; i < line.segments(); i += 8) {
        for (const double middle : {line.time(i), line.time(i) + 0.5 * line.span(i)})
            parts.emplace_back(std::clamp(middle - 0.5 * kPart, 0.0, end - kPart), kPart);
    }
    return parts;
}

// Calls `check` with a segment and a time in it: near both of its points, and between.
template <class Check>
void for_each_time(const Polyline& line, double from, double to, const Check& check) {
    line.for_each(from, to, [&](std::size_t i, double) {
        const double begin = line.time(i), span = line.span(i);
        const auto take = [&](double after) {
            if (begin + after >= from && begin + after <= to) check(i, begin + after);
        };
        for (int j = 0; j <= 6; ++j) take(span * j / 6.0);
        for (const double after : {0.4, 1.1, 2.2, 3.4, 5.0, 7.0}) {
            if (after > 0.5 * span) continue;
            take(after);
            take(span - after);
        }
    });
}

// Bounds that camera_path.h states.
constexpr double kMostOfChord = 0.53;      // of the distance of two points
constexpr double kMostSeconds = 1.5;       // of motion between two points
constexpr double kMostRecorded = 2.3;      // seconds of a recorded track's fastest motion
constexpr double kReachRecorded = 6.0;     // seconds around a time in which that motion is
constexpr double kMostWithoutTimes = 7.7;  // metres
constexpr double kMostSpeed = 2.5;         // times the speed of the motion

// Seconds before and after a time in which a track without smoothing covers more than its path may be off.
constexpr double kReach = 3.0;

// The worst shares of bounds that were met.
struct Worst {
    double line = 0.0;     // distance from the polyline
    double motion = 0.0;   // distance from uniform motion
    double covered = 0.0;  // the same, of what uniform motion covers around the time
    double speed = 0.0;
};

// A share of a bound, beyond `slack` for rounding.
double share(double value, double slack, double bound) {
    return value <= slack ? 0.0 : (value - slack) / std::max(bound, 1e-300);
}

void expect_pose(const CameraPose& pose) {
    ASSERT_TRUE(pose.eye_world.allFinite() && pose.velocity.allFinite());
    ASSERT_NEAR(pose.forward.norm(), 1.0, 1e-9);
    ASSERT_NEAR(pose.up.norm(), 1.0, 1e-9);
    ASSERT_NEAR(pose.up.dot(pose.forward), 0.0, 1e-9);
}

// Compares a path at the track's own times with uniform motion along the polyline.
Worst compare(const Track& track) {
    const Polyline line(track);
    Worst worst;
    const double slack = 1e-6 + 1e-10 * line.size();
    for (const auto& part : parts_of(line)) {
        const auto start = part.first, seconds = part.second;
        const CameraPath path = follow(track, {.start = start, .seconds = seconds});
        for_each_time(line, start, start + seconds, [&](std::size_t i, double time) {
            const CameraPose pose = path.at(time - start);
            expect_pose(pose);
            const double speed = line.length(i) / line.span(i);
            double bound = std::min(kMostOfChord * line.length(i), kMostSeconds * speed);
            double most_speed = kMostSpeed * speed;
            if (track.is_recorded) {
                const double fastest = line.fastest(time - kReachRecorded, time + kReachRecorded);
                bound = kMostRecorded * fastest;
                most_speed = kMostSpeed * fastest;
            }
            const double off = (pose.eye_world - line.at(i, time)).norm();
            worst.line = std::max(worst.line, share(line.distance(pose.eye_world), slack, bound));
            worst.motion = std::max(worst.motion, share(off, slack, bound));
            const double reach = track.is_recorded ? kReachRecorded : kReach;
            worst.covered = std::max(worst.covered,
                                     share(off, slack, line.covered(time - reach, time + reach)));
            // At the time of a point, the velocity is that of either side.
            const bool is_inside = time > line.time(i) && time < line.time(i + 1);
            if (is_inside) {
                worst.speed =
                    std::max(worst.speed, share(pose.velocity.norm(), 10.0 * slack, most_speed));
            }
        });
    }
    return worst;
}

// The worst distance of a path at a constant speed from the polyline, whose ends it keeps.
double worst_distance(const Track& track, double speed) {
    const Polyline line(track);
    const CameraPath path = follow(track, {.speed = speed});
    const double slack = 1e-6 + 1e-10 * line.size();
    EXPECT_LT((path.at(0.0).eye_world - line.place(0)).norm(), slack);
    EXPECT_LT((path.at(path.duration()).eye_world - line.place(line.segments())).norm(), slack);
    double worst = 0.0;
    for (int i = 0; i <= 300; ++i) {
        const CameraPose pose = path.at(path.duration() * i / 300.0);
        expect_pose(pose);
        EXPECT_LE(pose.velocity.norm(), kMostSpeed * speed + 1e-6 * speed);
        worst = std::max(worst, line.distance(pose.eye_world) - slack);
    }
    return worst;
}

TEST(TrackShapes, AreReadFromTheirFilesWithinTheirRounding) {
    int compared = 0;
    for (const Shape& shape : shapes()) {
        SCOPED_TRACE(shape.name + ", " + shape.file);
        const Track track = read(shape);
        ASSERT_TRUE(track.validate());
        ASSERT_TRUE(track.has_times && track.has_heights);
        const std::string counted = format("%zu of %zu", shape.heightless, shape.fixes.size());
        EXPECT_EQ(track.note.find(counted) != std::string::npos, shape.heightless > 0)
            << track.note;
        EXPECT_EQ(track.note.empty(), shape.heightless == 0) << track.note;
        if (track.points.size() != shape.fixes.size()) continue;  // equal times are merged
        ++compared;
        double worst = 0.0;
        for (std::size_t i = 0; i < track.points.size(); ++i) {
            const Eigen::Vector3d off = track.points[i].position_world - shape.fixes[i].place;
            worst = std::max(worst, shape.heightless > 0 ? off.head<2>().norm() : off.norm());
        }
        EXPECT_LT(worst, shape.rounding);
    }
    EXPECT_GE(compared, 110);
}

TEST(TrackShapes, PathsStayWithinTheirBoundsOfThePolyline) {
    const std::vector<Shape> all = shapes();
    ASSERT_GE(all.size(), 130u);
    Worst of_plain, of_recorded;
    const auto merge = [](Worst& to, const Worst& from) {
        to.line = std::max(to.line, from.line);
        to.motion = std::max(to.motion, from.motion);
        to.covered = std::max(to.covered, from.covered);
        to.speed = std::max(to.speed, from.speed);
    };
    for (const Shape& shape : all) {
        Track track = read(shape);
        for (const bool is_recorded : {false, true}) {
            SCOPED_TRACE(shape.name + ", " + shape.file + (is_recorded ? ", smoothed" : ""));
            track.is_recorded = is_recorded;
            const Worst worst = compare(track);
            EXPECT_LE(worst.line, 1.0);
            EXPECT_LE(worst.motion, 1.0);
            EXPECT_LE(worst.covered, 1.0);
            EXPECT_LE(worst.speed, 1.0);
            merge(is_recorded ? of_recorded : of_plain, worst);
        }
    }
    const auto record = [](const char* name, const Worst& w) {
        RecordProperty(name, format("line %.3f, motion %.3f, covered %.3f, speed %.3f", w.line,
                                    w.motion, w.covered, w.speed));
    };
    record("shares_of_bounds", of_plain);
    record("shares_of_bounds_smoothed", of_recorded);
}

TEST(TrackShapes, PathsAtAConstantSpeedStayWithinTheirBoundsOfThePolyline) {
    for (const Shape& shape : shapes()) {
        SCOPED_TRACE(shape.name + ", " + shape.file);
        Track track = read(shape);
        const Polyline line(track);
        if (line.whole_length() < 1.0) continue;
        const double speed = line.whole_length() / 200.0;
        track.is_recorded = false;
        EXPECT_LE(worst_distance(track, speed),
                  std::min(kMostOfChord * line.longest(), kMostSeconds * speed));
        track.is_recorded = true;
        const double fastest = line.fastest(0.0, line.time(line.segments()));
        EXPECT_LE(worst_distance(track, speed), kMostRecorded * fastest);
        track.has_times = false;
        EXPECT_LE(worst_distance(track, speed), kMostWithoutTimes);
    }
}

}  // namespace track_shapes_test
}  // namespace terrane
