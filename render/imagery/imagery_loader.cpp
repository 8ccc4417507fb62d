// SPDX-License-Identifier: MIT
#include "imagery/imagery_loader.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {

ImageryLoader::ImageryLoader(std::shared_ptr<const ImagerySource> source)
    : source_(std::move(source)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

ImageryLoader::~ImageryLoader() = default;

void ImageryLoader::request(std::vector<ImageryRequest> wanted) {
    {
        const std::lock_guard lock(mutex_);
        // squares that are being read, or have been read and not taken, are not read again
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
        // the user's source, or no memory: the square counts as failed
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
