// SPDX-License-Identifier: MIT
#include "terrain/ground_imagery.h"

#include "gl/gl_object.h"
#include "gl/shader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

namespace terrane::internal {
namespace {

// Squares uploaded per frame: 1.31 MiB.
constexpr std::size_t kUploadsAFrame = 4;
// Squares queued for the loader: more would be out of date by the time they are read.
constexpr std::size_t kRequests = 32;
constexpr int kMostLayers = 2048;  // the limit that every device supports
constexpr std::size_t kLevels = kMostImageryLevel + 1;

// The uniform block `Imagery` of imagery.glsl, in its std140 layout.
struct ImageryBlock {
    float root_texel = 1.0f;
    std::int32_t finest_level = 0;
    std::int32_t mask = 0;
    float texel = 1.0f;
    std::array<std::array<float, 4>, kLevels> levels{};
};
static_assert(sizeof(ImageryBlock) == 16 + 16 * kLevels);

// Byte offset of the table in the buffer: a multiple of 256, the largest alignment that devices require.
constexpr std::size_t kTableOffset = 512;
static_assert(kTableOffset >= sizeof(ImageryBlock));

std::size_t layers_in(std::size_t memory_bytes) {
    GLint most = kMostLayers;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &most);
    return std::clamp<std::size_t>(memory_bytes / GroundImagery::layer_bytes(), 1,
                                   static_cast<std::size_t>(std::clamp(most, 1, kMostLayers)));
}

}  // namespace

GroundImagery::GroundImagery(std::shared_ptr<const ImagerySource> source, std::size_t memory_bytes,
                             bool waits)
    : source_(std::move(source)),
      waits_(waits),
      layer_count_(layers_in(memory_bytes)),
      squares_(make_texture_2d_array()),
      table_(make_texture_buffer()),
      loader_(source_) {
    const GLuint name = squares_.name();
    glTextureStorage3D(name, kImageryMipmaps, GL_RGBA8, kImageryTexels, kImageryTexels,
                       static_cast<GLsizei>(layer_count_));
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    for (std::size_t layer = layer_count_; layer-- > 0;)
        free_layers_.push_back(static_cast<int>(layer));
}

// A free layer, or the least recently wanted one that is not wanted in this frame; -1: none.
int GroundImagery::allocate_layer() {
    if (free_layers_.empty()) {
        auto oldest = slots_.end();
        for (auto slot = slots_.begin(); slot != slots_.end(); ++slot) {
            if (slot->second.layer < 0 || slot->second.wanted_frame >= frame_) continue;
            if (oldest == slots_.end() || slot->second.wanted_frame < oldest->second.wanted_frame)
                oldest = slot;
        }
        if (oldest == slots_.end()) return -1;
        free_layers_.push_back(oldest->second.layer);
        slots_.erase(oldest);
    }
    const int layer = free_layers_.back();
    free_layers_.pop_back();
    return layer;
}

void GroundImagery::upload(const ImageryLoad& load) {
    if (slots_.contains(load.request.square)) return;
    Slot slot{.wanted_frame = frame_, .presence = waits_ ? 1.0f : 0.0f};
    if (load.texture) {
        slot.layer = allocate_layer();
        if (slot.layer < 0) return;
        glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
        for (int mipmap = 0; mipmap < kImageryMipmaps; ++mipmap) {
            const int side = kImageryTexels >> mipmap;
            glTextureSubImage3D(squares_.name(), mipmap, 0, 0, slot.layer, side, side, 1, GL_RGBA,
                                GL_UNSIGNED_BYTE,
                                load.texture->mipmaps[static_cast<std::size_t>(mipmap)].data());
        }
    } else {
        ++failure_count_;
    }
    slots_[load.request.square] = slot;
}

// Requests absent squares, and uploads some of those that have been read.
void GroundImagery::load(const ResidentSet& resident, const std::vector<ImagerySquare>& wanted) {
    const auto request_of = [&](const ImagerySquare& square) -> ImageryRequest {
        return {square, imagery_rect_with_border(resident.lattice(), square)};
    };
    const auto has_arrived = [&](const ImagerySquare& square) {
        return std::ranges::any_of(
            arrived_, [&](const ImageryLoad& load) { return load.request.square == square; });
    };
    std::vector<ImageryRequest> absent;
    for (const ImagerySquare& square : wanted) {
        const auto slot = slots_.find(square);
        if (slot != slots_.end()) {
            slot->second.wanted_frame = frame_;
        } else if ((absent.size() < kRequests || waits_) && !has_arrived(square)) {
            absent.push_back(request_of(square));
        }
    }
    loader_.request(std::move(absent));
    if (waits_) loader_.finish();
    for (ImageryLoad& load : loader_.take()) arrived_.push_back(std::move(load));
    // drops squares that are out of view by now, or of another world
    std::erase_if(arrived_, [&](const ImageryLoad& load) {
        return std::ranges::find(wanted, load.request.square) == wanted.end() ||
               load.request != request_of(load.request.square);
    });
    const std::size_t count = waits_ ? arrived_.size() : std::min(arrived_.size(), kUploadsAFrame);
    for (std::size_t i = 0; i < count; ++i) upload(arrived_[i]);
    arrived_.erase(arrived_.begin(), arrived_.begin() + static_cast<std::ptrdiff_t>(count));
    // forgets failed squares that are no longer wanted
    std::erase_if(slots_, [&](const auto& slot) {
        return slot.second.layer < 0 && slot.second.wanted_frame < frame_;
    });
}

Result<void> GroundImagery::prepare(const ResidentSet& resident, const View& view) {
    ++frame_;
    if (!(resident.lattice() == lattice_)) {
        // another world: squares are elsewhere
        lattice_ = resident.lattice();
        for (const auto& [square, slot] : slots_) {
            if (slot.layer >= 0) free_layers_.push_back(slot.layer);
        }
        slots_.clear();
    }
    const std::vector<ImagerySquare> wanted =
        select_imagery(resident, view, source_->rect(), source_->texel_size(), layer_count_);
    load(resident, wanted);
    for (auto& [square, slot] : slots_)
        slot.presence = std::min(slot.presence + 1.0f / kFadeFrames, 1.0f);
    return write_table(resident.lattice(), view);
}

Result<void> GroundImagery::write_table(const Lattice& lattice, const View& view) {
    SquareTable table(square_count());
    const std::size_t table_bytes = table.entries().size_bytes();
    std::byte* memory = stream_.begin(kTableOffset + table_bytes);
    if (memory == nullptr) {
        return fail(ErrorCode::device_unavailable, "OpenGL cannot take " +
                                                       std::to_string(kTableOffset + table_bytes) +
                                                       " bytes of the device for imagery");
    }
    ImageryBlock block;
    block.root_texel = static_cast<float>(imagery_side(lattice, 0) / kImageryContent);
    block.finest_level = finest_imagery_level(lattice, source_->texel_size());
    block.mask = table.mask();
    block.texel = static_cast<float>(source_->texel_size());
    std::array<std::array<std::int64_t, 2>, kLevels> eye_square{};
    for (std::size_t level = 0; level < kLevels; ++level) {
        const double side = imagery_side(lattice, static_cast<int>(level));
        const double x = (view.eye_world.x() - lattice.origin_x) / side;
        const double y = (view.eye_world.y() - lattice.origin_y) / side;
        eye_square[level] = {static_cast<std::int64_t>(std::floor(x)),
                             static_cast<std::int64_t>(std::floor(y))};
        block.levels[level] = {static_cast<float>(x - std::floor(x)),
                               static_cast<float>(y - std::floor(y)),
                               static_cast<float>(1.0 / side), 0.0f};
    }
    for (const auto& [square, slot] : slots_) {
        if (slot.layer < 0) continue;
        const auto& eye = eye_square[static_cast<std::size_t>(square.level)];
        // the layer and the presence, 0 to 255
        const auto presence = static_cast<std::int32_t>(std::lround(255.0f * slot.presence));
        table.add(square.x - eye[0], square.y - eye[1], square.level, slot.layer * 256 + presence);
    }
    std::memcpy(memory, &block, sizeof(block));
    std::memcpy(memory + kTableOffset, table.entries().data(), table_bytes);
    glTextureBufferRange(table_.name(), GL_RGBA32I, stream_.name(), kTableOffset,
                         static_cast<GLsizeiptr>(table_bytes));
    return {};
}

void GroundImagery::bind() const {
    glBindTextureUnit(8, table_.name());
    glBindTextureUnit(9, squares_.name());
    glBindBufferRange(GL_UNIFORM_BUFFER, 3, stream_.name(), 0, sizeof(ImageryBlock));
}

std::size_t GroundImagery::square_count() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(slots_, [](const auto& entry) { return entry.second.layer >= 0; }));
}

}  // namespace terrane::internal
