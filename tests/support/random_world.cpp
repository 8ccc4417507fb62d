// SPDX-License-Identifier: MIT
#include "support/random_world.h"

#include "support/grounds.h"

#include <terrane/terrain/fractal_heights.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <sstream>

namespace terrane::test {
namespace {

bool is_chance(Random& random, double share) { return random.between(0.0, 1.0) < share; }

// 1 to 3 roots along an axis; 1 in half of the cases.
std::int32_t random_count(Random& random) { return std::max(1, random.below(6) - 2); }

std::shared_ptr<const HeightSource> random_fractal(Random& random) {
    FractalSettings settings{.seed = random.bits(),
                             .kind = static_cast<FractalKind>(random.below(4)),
                             .finest_spacing_log2 = random.below(7) - 3};
    settings.root_size_log2 = settings.finest_spacing_log2 + 7 + random.below(5);
    settings.octave_count = 2 + random.below(5);
    settings.wavelength_log2 = std::clamp(settings.root_size_log2 - random.below(4), 0, 24);
    settings.amplitude = std::ldexp(random.between(0.0, 0.4), settings.wavelength_log2);
    settings.gain = random.between(0.3, 0.8);
    settings.first_root_x = random.below(5) - 3;
    settings.first_root_y = random.below(5) - 3;
    settings.root_count_x = random_count(random);
    settings.root_count_y = random_count(random);
    return FractalHeights::create(settings).value();
}

std::shared_ptr<const HeightSource> random_waves(Random& random) {
    Lattice lattice{.finest_level = random.below(5)};
    lattice.spacing = std::ldexp(random.between(0.5, 1.0), random.below(7) - 3);
    lattice.origin_x = random.between(-1e3, 1e3);
    lattice.origin_y = random.between(-1e3, 1e3);
    lattice.first_root_x = random.below(5) - 3;
    lattice.first_root_y = random.below(5) - 3;
    lattice.root_count_x = random_count(random);
    lattice.root_count_y = random_count(random);
    const double wavelength = lattice.root_size() * random.between(0.1, 1.0);
    return std::make_shared<WaveHeights>(lattice, wavelength * random.between(0.0, 0.1),
                                         wavelength);
}

float random_fade(Random& random) {
    const double t = random.between(-0.5, 2.0);  // clamped to 0 or 1 in most cases
    return static_cast<float>(std::clamp(t, 0.0, 1.0));
}

}  // namespace

double random_magnitude(Random& random, double low, double high) {
    return std::clamp(low * std::exp2(random.between(0.0, std::log2(high / low))), low, high);
}

RandomWorld::RandomWorld(Random& random, int chunk_count)
    : source_(is_chance(random, 0.5) ? random_fractal(random) : random_waves(random)) {
    const Lattice& lattice = source_->lattice();
    std::map<ChunkKey, std::size_t> places;
    const auto add = [&](const ChunkKey& key) {
        const auto [place, is_new] = places.emplace(key, chunks_.size());
        if (!is_new) return false;
        parents_.push_back(key.level == 0 ? chunks_.size() : places.at(key.parent()));
        chunks_.push_back(make_chunk(*source_, key).value());
        return true;
    };
    for (std::int32_t y = 0; y < lattice.root_count_y; ++y) {
        for (std::int32_t x = 0; x < lattice.root_count_x; ++x) {
            add({lattice.first_root_x + x, lattice.first_root_y + y, 0});
        }
    }
    const auto root_count = static_cast<int>(chunks_.size());
    const int most = chunk_count + root_count;
    for (int tries = 0; tries < 4 * most && static_cast<int>(chunks_.size()) < most; ++tries) {
        ChunkKey key = chunks_[static_cast<std::size_t>(random.below(root_count))]->key;
        const int depth = random.below(lattice.finest_level + 1);
        for (int level = 0; level < depth && static_cast<int>(chunks_.size()) < most; ++level) {
            key = key.child(random.below(4));
            add(key);
        }
    }
}

std::size_t RandomWorld::root_triangles() const {
    return 2 * static_cast<std::size_t>(lattice().root_count_x) *
           static_cast<std::size_t>(lattice().root_count_y);
}

std::string RandomWorld::describe() const {
    std::ostringstream out;
    out << lattice().root_count_x << " x " << lattice().root_count_y << " roots, "
        << lattice().finest_level + 1 << " levels, spacing " << lattice().spacing << " m, "
        << chunks_.size() << " chunks";
    return out.str();
}

RandomResidence::RandomResidence(const RandomWorld& world)
    : world_(world), is_in_(world.chunks().size(), false), fades_(world.chunks().size(), 1.0f) {
    for (std::size_t i = 0; i < is_in_.size(); ++i) is_in_[i] = world.parent(i) == i;
    make_set(false);
}

void RandomResidence::jump(Random& random) {
    const double share = random.between(0.2, 1.0);
    const bool is_fading = is_chance(random, 0.6);
    for (std::size_t i = 0; i < is_in_.size(); ++i) {
        const bool is_root = world_.parent(i) == i;
        is_in_[i] = is_root || (is_in_[world_.parent(i)] && is_chance(random, share));
        fades_[i] = is_fading && !is_root ? random_fade(random) : 1.0f;
    }
    make_set(false);
}

void RandomResidence::step(Random& random) {
    const auto count = static_cast<int>(is_in_.size());
    bool has_same_chunks = true;
    for (int change = random.below(4); change > 0; --change) {
        const auto i = static_cast<std::size_t>(random.below(count));
        if (world_.parent(i) == i || !is_in_[world_.parent(i)]) continue;
        has_same_chunks = false;
        is_in_[i] = !is_in_[i];
        fades_[i] = random_fade(random);
        // also evicts the descendants
        for (std::size_t k = i + 1; k < is_in_.size(); ++k) {
            if (!is_in_[world_.parent(k)]) is_in_[k] = false;
        }
    }
    const float factor = is_chance(random, 0.5) ? 1.05f : 0.9f;
    for (std::size_t i = 0; i < fades_.size(); ++i) {
        if (world_.parent(i) != i) fades_[i] = std::min(1.0f, fades_[i] * factor);
    }
    make_set(has_same_chunks);
}

void RandomResidence::make_set(bool has_same_chunks) {
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::vector<float> fades;
    if (has_same_chunks) {
        std::map<ChunkKey, float> by_key;
        for (std::size_t i = 0; i < fades_.size(); ++i) {
            by_key[world_.chunks()[i]->key] = fades_[i];
        }
        for (const auto& chunk : resident_->chunks()) fades.push_back(by_key.at(chunk->key));
        resident_ = std::make_shared<const ResidentSet>(*resident_, std::move(fades), ++epoch_);
        return;
    }
    for (std::size_t i = 0; i < is_in_.size(); ++i) {
        if (!is_in_[i]) continue;
        chunks.push_back(world_.chunks()[i]);
        fades.push_back(fades_[i]);
    }
    resident_ = std::make_shared<const ResidentSet>(world_.lattice(), world_.source().extent(),
                                                    std::move(chunks), fades, ++epoch_);
}

View random_view(Random& random, const RandomWorld& world) {
    const Lattice& lattice = world.lattice();
    const WorldRect extent = whole_extent(lattice);
    const double size = lattice.root_size();
    const auto over_ground = [&](double above) {
        const double x = random.between(extent.west, extent.east);
        const double y = random.between(extent.south, extent.north);
        return WorldPos(x, y, world.source().height(x, y) + above);
    };
    WorldPos eye = over_ground(random_magnitude(random, 1e-3 * size, size));
    Eigen::Vector3d forward = random.direction();
    forward.z() = -0.3 * std::abs(forward.z());
    double fov = random.between(0.3, 1.8);
    switch (random.below(18)) {
        case 0:  // below the ground
            eye = over_ground(-random_magnitude(random, 1e-3 * size, 10.0 * size));
            forward = random.direction();
            break;
        case 1: {  // at a vertex
            const auto between = [&](std::int64_t low, std::int64_t high) {
                return low + random.below(static_cast<int>(high - low + 1));
            };
            const std::int64_t x = between(lattice.west(), lattice.east());
            const std::int64_t y = between(lattice.south(), lattice.north());
            const double z = world.source().height(lattice.x(x), lattice.y(y));
            eye = {lattice.x(x), lattice.y(y), lattice.quantum * std::round(z / lattice.quantum)};
            break;
        }
        case 2:  // far away, looking back or in a random direction
            eye = 1e9 * random.direction();
            forward =
                is_chance(random, 0.7) ? Eigen::Vector3d(-eye / eye.norm()) : random.direction();
            break;
        case 3:
            forward = {0.0, 0.0, is_chance(random, 0.7) ? -1.0 : 1.0};
            break;
        case 4:
        case 5:
            fov = random_magnitude(random, 1e-3, 3.1);
            break;
        default:
            break;
    }
    View view =
        look_at(eye, eye + 1e3 * forward, fov, 1 + random.below(2000), 1 + random.below(1200))
            .value();
    view.near_distance = random_magnitude(random, 1e-3, 30.0);
    return view;
}

View moved_view(Random& random, const RandomWorld& world, const View& view) {
    const double step = random_magnitude(random, 1e-5, 1e-1) * world.lattice().root_size();
    const WorldPos eye = view.eye_world + step * random.direction();
    const Eigen::Vector3d forward = view.forward + 0.05 * random.direction();
    View moved =
        look_at(eye, eye + 1e3 * forward, view.vertical_fov, view.width_px, view.height_px).value();
    moved.near_distance = view.near_distance;
    return moved;
}

View RandomResidence::fly(Random& random, const View* before) {
    const bool is_jump = before == nullptr || random.below(6) == 0;
    if (is_jump) {
        jump(random);
    } else if (random.below(3) != 0) {
        step(random);
    }
    return is_jump || random.below(8) == 0 ? random_view(random, world_)
                                           : moved_view(random, world_, *before);
}

std::string find_difference(const TerrainMesh& a, const TerrainMesh& b) {
    std::ostringstream out;
    out.precision(17);
    const auto compare = [&](const char* name, double x, double y) {
        if (std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y)) return;
        out << name << " " << x << " or " << y << "; ";
    };
    if (a.status != b.status) out << name_of(a.status) << " or " << name_of(b.status) << "; ";
    compare("error", a.error_px, b.error_px);
    compare("threshold", a.threshold_px, b.threshold_px);
    if (a.triangle_count != b.triangle_count || a.chunks.size() != b.chunks.size()) {
        out << a.triangle_count << " triangles of " << a.chunks.size() << " chunks or "
            << b.triangle_count << " of " << b.chunks.size();
        return out.str();
    }
    for (std::size_t i = 0; i < a.chunks.size(); ++i) {
        const MeshChunk& part = a.chunks[i];
        const MeshChunk& other = b.chunks[i];
        if (part.chunk->key != other.chunk->key || part.index_count != other.index_count) {
            out << "chunk " << i << " of the mesh; ";
            return out.str();
        }
        for (std::uint32_t k = 0; k < part.index_count; ++k) {
            const std::uint16_t sample = a.indices[part.first_index + k];
            if (sample != b.indices[other.first_index + k]) {
                out << "index " << k << " of chunk " << i << "; ";
                return out.str();
            }
            const float mine = part.offsets == nullptr ? 0.0f : part.offsets[sample];
            const float others = other.offsets == nullptr ? 0.0f : other.offsets[sample];
            if (std::bit_cast<std::uint32_t>(mine) != std::bit_cast<std::uint32_t>(others)) {
                out << "offset of sample " << sample << " of chunk " << i << ": " << mine << " or "
                    << others << "; ";
                return out.str();
            }
        }
    }
    return out.str();
}

}  // namespace terrane::test
