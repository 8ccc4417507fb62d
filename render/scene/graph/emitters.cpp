// SPDX-License-Identifier: MIT
//
// Source:     W. Reeves. Particle Systems: A Technique for Modeling a Class of Fuzzy Objects. ACM TOG 2(2), 1983.
// Deviations: a particle is not advanced from frame to frame, but a function of its number and the time; the drag is a
//             rational function instead of an exponential, so that its bits do not depend on the C library.
#include "graph/emitters.h"

#include "base/aabb_tree.h"
#include "base/settings_check.h"
#include "base/vector_math.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

namespace terrane::internal {
namespace {

// Share of its life in which a particle appears.
constexpr double kAppearing = 0.1;

// Random numbers of one particle (S. Vigna, SplitMix64).
class ParticleRandom {
public:
    ParticleRandom(std::uint64_t seed, std::int64_t number)
        : state_(seed * 0x9e3779b97f4a7c15u ^ mixed(static_cast<std::uint64_t>(number))) {}

    // From 0 to below 1.
    double next() {
        state_ += 0x9e3779b97f4a7c15u;
        return static_cast<double>(mixed(state_) >> 11) * 0x1p-53;
    }

    // Uniform in the unit ball.
    Eigen::Vector3d in_ball() {
        for (;;) {
            const double x = 2.0 * next() - 1.0, y = 2.0 * next() - 1.0, z = 2.0 * next() - 1.0;
            if (x * x + y * y + z * z <= 1.0) return {x, y, z};
        }
    }

private:
    static std::uint64_t mixed(std::uint64_t x) {
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
        return x ^ (x >> 31);
    }

    std::uint64_t state_;
};

// The place at a time. Its rotation, scale and strength are those of the place before.
EmitterPlace place_at(std::span<const EmitterPlace> places, double time) {
    const auto after = std::ranges::upper_bound(places, time, {}, &EmitterPlace::time);
    if (after == places.begin()) return places.front();
    EmitterPlace at = *std::prev(after);
    if (after == places.end()) return at;
    const double share = (time - at.time) / (after->time - at.time);
    WorldPos& p = at.place.world_from_node.translation;
    p += share * (after->place.world_from_node.translation - p);
    return at;
}

// Distance of a particle's points from its centre relative to its radius: the corners of an image are outside the disc.
double corner_of(const EmitterNode& emitter) {
    return emitter.image == ParticleImageId::soft_disc ? 1.0 : std::numbers::sqrt2;
}

// Distance that the points of a particle can have from its birth, metres.
double most_reach(const EmitterNode& emitter, double scale) {
    const double life = emitter.life[1];
    const double speed =
        scale * (length(emitter.velocity) + emitter.velocity_spread) + 2.0 * length(emitter.wind);
    const double most_radius = std::max(emitter.radius[0], emitter.radius[1]);
    return scale * (emitter.source_radius + corner_of(emitter) * most_radius) +
           life * (speed + 0.5 * life * length(emitter.acceleration));
}

}  // namespace

void append_particles(const EmitterNode& emitter, std::span<const EmitterPlace> places, double time,
                      const WorldPos& eye_world, std::vector<Particle>& particles_out) {
    if (!(emitter.rate > 0.0) || !(time >= emitter.start)) return;
    // particle n is born at (n + jitter) / rate, with a jitter of 0 to 1
    const double oldest = std::max(time - emitter.life[1], emitter.start);
    const auto last = static_cast<std::int64_t>(std::floor(time * emitter.rate));
    const auto first = std::max(static_cast<std::int64_t>(std::floor(oldest * emitter.rate)) - 1,
                                last - static_cast<std::int64_t>(emitter.most_particles) + 1);
    for (std::int64_t number = first; number <= last; ++number) {
        ParticleRandom random(emitter.seed, number);
        const double birth = (static_cast<double>(number) + random.next()) / emitter.rate;
        const double age = time - birth;
        const double life = emitter.life[0] + random.next() * (emitter.life[1] - emitter.life[0]);
        const Eigen::Vector3d offset = emitter.source_radius * random.in_ball();
        const Eigen::Vector3d velocity =
            emitter.velocity + emitter.velocity_spread * random.in_ball();
        if (!(age >= 0.0 && age < life) || birth < emitter.start) continue;
        const EmitterPlace at_birth = place_at(places, birth);
        if (at_birth.strength == 0.0f) continue;
        const WorldPlace& place = at_birth.place;
        const Eigen::Matrix3d& axes = place.world_from_node.rotation;
        // speeds relative to the wind fall as 1 / (1 + age / drag_time)^2
        const double slowed = age / (1.0 + age / emitter.drag_time);
        const Eigen::Vector3d start_velocity = axes * Eigen::Vector3d(place.scale * velocity);
        const WorldPos centre =
            place.world_from_node * Eigen::Vector3d(place.scale * offset) + age * emitter.wind +
            slowed * (start_velocity - emitter.wind + 0.5 * age * emitter.acceleration);
        const LocalVec from_eye = to_local(centre, eye_world);
        const double share = age / life;
        const double appeared = std::min(1.0, share / kAppearing);
        Particle particle;
        particle.offset_eye = {from_eye.x(), from_eye.y(), from_eye.z()};
        particle.radius = static_cast<float>(
            place.scale * (emitter.radius[0] + share * (emitter.radius[1] - emitter.radius[0])));
        for (std::size_t i = 0; i < 4; ++i) {
            particle.colour[i] =
                emitter.colours[0][i] +
                static_cast<float>(share) * (emitter.colours[1][i] - emitter.colours[0][i]);
        }
        particle.colour[3] *= at_birth.strength * static_cast<float>(appeared);
        if (emitter.image != ParticleImageId::soft_disc) {
            particle.turn = static_cast<float>(2.0 * std::numbers::pi * random.next());
            particle.image = emitter.image;
        }
        particles_out.push_back(particle);
    }
}

void Emitters::add(NodeId node) { tracks_.try_emplace(node); }

void Emitters::remove(NodeId node) { tracks_.erase(node); }

void Emitters::set_time(double time, const NodeStore& nodes) {
    time_ = time;
    for (auto& [node, places] : tracks_) {
        const auto& emitter = std::get<EmitterNode>(nodes.at(node).content);
        std::erase_if(places, [&](const EmitterPlace& each) { return each.time >= time; });
        // the last place before the oldest particle's birth is needed
        const auto needed =
            std::ranges::upper_bound(places, time - emitter.life[1], {}, &EmitterPlace::time);
        if (needed != places.begin()) places.erase(places.begin(), std::prev(needed));
        places.push_back({time, nodes.place_world(node), emitter.strength});
    }
}

void Emitters::append(const NodeStore& nodes, const View& view, const ViewVolume& volume,
                      double least_px, std::vector<Particle>& particles_out) const {
    for (const auto& [node, track] : tracks_) {
        const auto& emitter = std::get<EmitterNode>(nodes.at(node).content);
        const EmitterPlace here = {time_, nodes.place_world(node), emitter.strength};
        const std::span<const EmitterPlace> places =
            track.empty() ? std::span(&here, 1) : std::span(track);
        Aabb box = empty_box();
        double most_radius = 0.0;
        for (const EmitterPlace& each : places) {
            include(each.place.world_from_node.translation, most_reach(emitter, each.place.scale),
                    box);
            most_radius = std::max(
                most_radius, each.place.scale * std::max(emitter.radius[0], emitter.radius[1]));
        }
        PlaneState planes;
        if (volume.test_planes(box, planes) == Containment::outside) continue;
        const WorldPos nearest = view.eye_world.cwiseMax(box.low).cwiseMin(box.high);
        const double distance = std::max(length(nearest - view.eye_world), view.near_distance);
        if (!(most_radius * view.pixels_per_radian() / distance > least_px)) continue;
        append_particles(emitter, places, time_, view.eye_world, particles_out);
    }
}

Result<void> check_emitter(const EmitterNode& emitter) {
    TERRANE_TRY(check_range("strength", static_cast<double>(emitter.strength), 0.0, 1.0));
    TERRANE_TRY(check_range("rate", emitter.rate, 0.0, 1e5));
    TERRANE_TRY(check_range("life[0]", emitter.life[0], 1e-3, 1e3));
    TERRANE_TRY(check_range("life[1]", emitter.life[1], emitter.life[0], 1e3));
    TERRANE_TRY(check_range("velocity_spread", emitter.velocity_spread, 0.0, 1e4));
    TERRANE_TRY(check_range("source_radius", emitter.source_radius, 0.0, 1e4));
    TERRANE_TRY(check_range("drag_time", emitter.drag_time, 1e-3, 1e9));
    TERRANE_TRY(check_range("radius[0]", emitter.radius[0], 1e-3, 1e4));
    TERRANE_TRY(check_range("radius[1]", emitter.radius[1], 1e-3, 1e4));
    TERRANE_TRY(
        check_range("most_particles", static_cast<double>(emitter.most_particles), 1.0, 65536.0));
    const std::pair<const char*, const Eigen::Vector3d*> vectors[] = {
        {"velocity", &emitter.velocity},
        {"wind", &emitter.wind},
        {"acceleration", &emitter.acceleration}};
    for (const auto& [name, vector] : vectors) {
        if (!(vector->cwiseAbs().maxCoeff() <= 1e4) || !is_finite(*vector))
            return fail(ErrorCode::invalid_argument,
                        std::string(name) + " must be within 1e4 along each axis");
    }
    for (const auto& colour : emitter.colours) {
        for (const float value : colour) {
            if (!(value >= 0.0f && value <= 1.0f))
                return fail(
                    ErrorCode::invalid_argument,
                    "colours must be 0 to 1, got " + number_text(static_cast<double>(value)));
        }
    }
    if (std::isnan(emitter.start) || emitter.start > 1e12)
        return fail(ErrorCode::invalid_argument,
                    "start must be at most 1e12, got " + number_text(emitter.start));
    return {};
}

}  // namespace terrane::internal
