// SPDX-License-Identifier: MIT
#include "terrain/imagery_squares.h"

#include <terrane/scene/culling.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <utility>

namespace terrane::internal {

double imagery_side(const Lattice& lattice, int level) {
    return std::ldexp(lattice.root_size(), -level);
}

WorldRect imagery_rect(const Lattice& lattice, const ImagerySquare& square) {
    const double side = imagery_side(lattice, square.level);
    const double west = lattice.origin_x + side * static_cast<double>(square.x);
    const double south = lattice.origin_y + side * static_cast<double>(square.y);
    return {west, south, west + side, south + side};
}

WorldRect imagery_rect_with_border(const Lattice& lattice, const ImagerySquare& square) {
    const WorldRect rect = imagery_rect(lattice, square);
    const double border = (rect.east - rect.west) * kImageryBorder / kImageryContent;
    return {rect.west - border, rect.south - border, rect.east + border, rect.north + border};
}

ImageryTexture make_imagery_texture(std::vector<ImageryTexel> texels) {
    for (ImageryTexel& texel : texels) {
        for (std::size_t channel = 0; channel < 3; ++channel)
            texel[channel] = static_cast<std::uint8_t>((texel[channel] * texel[3] + 127) / 255);
    }
    ImageryTexture made;
    made.mipmaps[0] = std::move(texels);
    for (std::size_t mipmap = 1; mipmap < kImageryMipmaps; ++mipmap) {
        const std::vector<ImageryTexel>& finer = made.mipmaps[mipmap - 1];
        const std::size_t side = std::size_t{kImageryTexels} >> mipmap;
        std::vector<ImageryTexel>& coarser = made.mipmaps[mipmap];
        coarser.resize(side * side);
        for (std::size_t row = 0; row < side; ++row) {
            for (std::size_t column = 0; column < side; ++column) {
                const std::size_t first = 2 * row * 2 * side + 2 * column;
                for (std::size_t channel = 0; channel < 4; ++channel) {
                    const int sum = finer[first][channel] + finer[first + 1][channel] +
                                    finer[first + 2 * side][channel] +
                                    finer[first + 2 * side + 1][channel];
                    coarser[row * side + column][channel] =
                        static_cast<std::uint8_t>((sum + 2) / 4);
                }
            }
        }
    }
    return made;
}

namespace {

// Root squares more than this many root squares away from the eye's are ignored.
constexpr std::int64_t kMostRoots = 16;

bool do_meet(const WorldRect& a, const WorldRect& b) {
    return a.west < b.east && b.west < a.east && a.south < b.north && b.south < a.north;
}

// Box of a square, with the heights of the finest resident chunk that contains the square.
Aabb box_of(const ResidentSet& resident, const ImagerySquare& square) {
    const Lattice& lattice = resident.lattice();
    const WorldRect rect = imagery_rect(lattice, square);
    int level = square.level;
    double low = 0.0, high = 0.0;
    for (std::int64_t x = square.x, y = square.y; level >= 0; --level, x >>= 1, y >>= 1) {
        if (level > lattice.finest_level) continue;
        const ChunkKey key{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                           static_cast<std::uint8_t>(level)};
        const std::int32_t index = resident.find(key);
        if (index == ResidentSet::kNone) continue;
        const Chunk& chunk = *resident.chunks()[static_cast<std::size_t>(index)];
        low = lattice.quantum * chunk.low;
        high = lattice.quantum * chunk.high;
        break;
    }
    return {{rect.west, rect.south, low}, {rect.east, rect.north, high}};
}

double distance_to(const Aabb& box, const WorldPos& p) {
    return (p - p.cwiseMax(box.low).cwiseMin(box.high)).norm();
}

std::vector<ImagerySquare> roots_around(const Lattice& lattice, const WorldPos& eye,
                                        const WorldRect& rect) {
    const double side = imagery_side(lattice, 0);
    const auto range = [&](double place, double origin, std::int32_t first, std::int32_t count) {
        const double most = static_cast<double>(first + count);
        const auto root = static_cast<std::int64_t>(
            std::clamp(std::floor((place - origin) / side), static_cast<double>(first), most));
        return std::pair(std::max<std::int64_t>(first, root - kMostRoots),
                         std::min<std::int64_t>(first + count - 1, root + kMostRoots));
    };
    const auto [west, east] =
        range(eye.x(), lattice.origin_x, lattice.first_root_x, lattice.root_count_x);
    const auto [south, north] =
        range(eye.y(), lattice.origin_y, lattice.first_root_y, lattice.root_count_y);
    std::vector<ImagerySquare> roots;
    for (std::int64_t y = south; y <= north; ++y) {
        for (std::int64_t x = west; x <= east; ++x) {
            const ImagerySquare root{.level = 0, .y = y, .x = x};
            if (do_meet(imagery_rect(lattice, root), rect)) roots.push_back(root);
        }
    }
    return roots;
}

}  // namespace

int finest_imagery_level(const Lattice& lattice, double texel_size) {
    int level = 0;
    while (level < kMostImageryLevel && imagery_side(lattice, level) / kImageryContent > texel_size)
        ++level;
    return level;
}

std::vector<ImagerySquare> select_imagery(const ResidentSet& resident, const View& view,
                                          const WorldRect& rect, double texel_size,
                                          std::size_t most) {
    const Lattice& lattice = resident.lattice();
    const int finest = finest_imagery_level(lattice, texel_size);
    const double radians_per_pixel = 1.0 / view.pixels_per_radian();
    const ViewVolume volume(view);
    std::vector<ImagerySquare> selected;
    std::set<ImagerySquare> known;
    const std::vector<ImagerySquare> roots = roots_around(lattice, view.eye_world, rect);
    for (const bool is_for_view : {true, false}) {
        // breadth first: a square precedes the squares that it contains
        std::vector<ImagerySquare> level = roots, next;
        while (!level.empty()) {
            next.clear();
            for (const ImagerySquare& square : level) {
                const Aabb box = box_of(resident, square);
                if (is_for_view && !volume.meets(box)) continue;
                if (known.insert(square).second) {
                    if (selected.size() == most) return selected;
                    selected.push_back(square);
                }
                const double pixel = distance_to(box, view.eye_world) * radians_per_pixel;
                if (square.level >= finest ||
                    pixel >= imagery_side(lattice, square.level) / kImageryContent)
                    continue;
                for (int quadrant = 0; quadrant < 4; ++quadrant) {
                    const ImagerySquare child{.level = square.level + 1,
                                              .y = 2 * square.y + (quadrant >> 1),
                                              .x = 2 * square.x + (quadrant & 1)};
                    if (do_meet(imagery_rect(lattice, child), rect)) next.push_back(child);
                }
            }
            std::swap(level, next);
        }
    }
    return selected;
}

ImageryLoader::ImageryLoader(std::shared_ptr<const ImagerySource> source)
    : source_(std::move(source)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

ImageryLoader::~ImageryLoader() = default;

void ImageryLoader::request(std::vector<ImageryRequest> wanted) {
    {
        const std::lock_guard lock(mutex_);
        // skips the square that is being read, and those that have been read but not taken
        std::erase_if(wanted, [&](const ImageryRequest& request) {
            return request == loading_ ||
                   std::ranges::find(loaded_, request, &ImageryLoad::request) != loaded_.end();
        });
        std::ranges::reverse(wanted);
        wanted_ = std::move(wanted);
    }
    changed_.notify_all();
}

std::vector<ImageryLoad> ImageryLoader::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(loaded_, {});
}

void ImageryLoader::finish() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return wanted_.empty() && !loading_; });
}

ImageryLoad ImageryLoader::load(const ImageryRequest& request) const {
    ImageryLoad load{request, std::nullopt};
    try {
        std::vector<ImageryTexel> texels(std::size_t{kImageryTexels} * kImageryTexels);
        if (source_->read(request.rect, kImageryTexels, texels))
            load.texture = make_imagery_texture(std::move(texels));
    } catch (...) {
        // the user's source threw, or memory ran out: the square counts as failed
        load.texture.reset();
    }
    return load;
}

void ImageryLoader::run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [&] { return !wanted_.empty(); }) && !stop.stop_requested()) {
        const ImageryRequest request = wanted_.back();
        wanted_.pop_back();
        loading_ = request;
        lock.unlock();
        ImageryLoad load = this->load(request);
        lock.lock();
        loading_.reset();
        loaded_.push_back(std::move(load));
        changed_.notify_all();
    }
}

}  // namespace terrane::internal
