// SPDX-License-Identifier: MIT
#include "light/ground_light.h"

#include "gl/gl_error.h"
#include "gl/square_table.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>

namespace terrane::internal {
namespace {

constexpr std::size_t kFirstLayers = 32;  // 4.4 MB
constexpr int kMostLayers = 2048;         // 278 MB, the limit that every device supports
constexpr std::size_t kLevels = 25;
constexpr std::size_t kSlopeBytes =
    sizeof(std::int16_t) * 2 * std::size_t{kSlopeMapWidth} * kSlopeMapHeight;
constexpr int kNodesAlong = 3;

// The uniform block `Light` of shade.frag, in its std140 layout.
struct LightBlock {
    float root_spacing = 1.0f;
    std::int32_t finest_level = 0;
    std::int32_t mask = 0;
    std::int32_t padding = 0;
    std::array<std::array<float, 4>, kLevels> levels{};
};
static_assert(sizeof(LightBlock) == 16 + 16 * kLevels);

// Offset of the table; 256 is the largest alignment that devices require.
constexpr std::size_t kTableOffset = 512;
static_assert(kTableOffset >= sizeof(LightBlock));

std::int64_t floor_divide(std::int64_t value, std::int64_t by) {
    return value / by - (value % by < 0 ? 1 : 0);
}

GlTexture make_layers(GLenum format, int width, int height, std::size_t count) {
    GlTexture texture = make_texture_2d_array();
    const GLuint name = texture.name();
    glTextureStorage3D(name, 1, format, width, height, static_cast<GLsizei>(count));
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

int most_layers() {
    GLint layers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
    return std::clamp<int>(layers, 1, kMostLayers);
}

}  // namespace

GroundLight::GroundLight() : levels_(most_layers()), table_(make_texture_buffer()) {
    hold_layers(kFirstLayers);
}

// Grows the arrays to `count` layers, keeping their content.
void GroundLight::hold_layers(std::size_t count) {
    if (count <= layers_.size()) return;
    const std::size_t capacity = std::min<std::size_t>(std::bit_ceil(std::max(count, kFirstLayers)),
                                                       static_cast<std::size_t>(most_layers()));
    GlTexture slopes = make_layers(GL_RG16_SNORM, kSlopeMapWidth, kSlopeMapHeight, capacity);
    GlTexture nodes = make_layers(GL_RG32F, kNodesAlong, kNodesAlong, capacity);
    if (!layers_.empty()) {
        const auto layer_count = static_cast<GLsizei>(layers_.size());
        glCopyImageSubData(slopes_.name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, slopes.name(),
                           GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, kSlopeMapWidth, kSlopeMapHeight,
                           layer_count);
        glCopyImageSubData(nodes_.name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, nodes.name(),
                           GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, kNodesAlong, kNodesAlong, layer_count);
    }
    slopes_ = std::move(slopes);
    nodes_ = std::move(nodes);
    layers_.resize(capacity);
}

Result<void> GroundLight::prepare(const std::shared_ptr<const ResidentSet>& resident,
                                  const View& view, const EyeFrame& eye) {
    levels_.update(resident, view);
    upload(*resident);
    return write_table(resident->lattice(), eye);
}

// Uploads changed slope maps, nodes and table.
void GroundLight::upload(const ResidentSet& resident) {
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    for (const LitChunk& lit : levels_.lit()) {
        const auto at = static_cast<std::size_t>(lit.layer);
        hold_layers(at + 1);
        Layer& layer = layers_[at];
        const SideLevels side_levels = find_side_levels(resident, lit.key);
        if (layer.chunk.lock().get() != lit.chunk || layer.side_levels != side_levels) {
            const std::int32_t index = resident.find(lit.key);
            const std::shared_ptr<const Chunk>& owner =
                resident.chunks()[static_cast<std::size_t>(index)];
            layer.chunk = owner;
            layer.side_levels = side_levels;
            const std::vector<std::int16_t> map = make_slope_map(resident, *lit.chunk, side_levels);
            glTextureSubImage3D(slopes_.name(), 0, 0, 0, lit.layer, kSlopeMapWidth, kSlopeMapHeight,
                                1, GL_RG, GL_SHORT, map.data());
            layer.nodes[0].level = -1.0f;  // invalid: from another chunk
        }
        if (layer.nodes == lit.nodes) continue;
        layer.nodes = lit.nodes;
        glTextureSubImage3D(nodes_.name(), 0, 0, 0, lit.layer, kNodesAlong, kNodesAlong, 1, GL_RG,
                            GL_FLOAT, layer.nodes.data());
    }
}

Result<void> GroundLight::write_table(const Lattice& lattice, const EyeFrame& eye) {
    SquareTable table(levels_.lit().size());
    const std::size_t table_bytes = table.entries().size_bytes();
    std::byte* memory = stream_.begin(kTableOffset + table_bytes);
    if (memory == nullptr) {
        return fail(ErrorCode::device_unavailable, "OpenGL cannot take " +
                                                       std::to_string(kTableOffset + table_bytes) +
                                                       " bytes of the device for the light");
    }
    LightBlock block;
    block.root_spacing = static_cast<float>(lattice.level_spacing(0));
    block.finest_level = lattice.finest_level;
    block.mask = table.mask();
    std::array<LatticePoint, kLevels> eye_chunk{};
    for (int level = 0; level <= lattice.finest_level; ++level) {
        const auto at = static_cast<std::size_t>(level);
        const std::int64_t side = lattice.chunk_side(level);
        eye_chunk[at] = {floor_divide(eye.x, side), floor_divide(eye.y, side)};
        const double x =
            static_cast<double>(eye.x - eye_chunk[at].x * side) + eye.remainder_x / lattice.spacing;
        const double y =
            static_cast<double>(eye.y - eye_chunk[at].y * side) + eye.remainder_y / lattice.spacing;
        const auto sides = static_cast<double>(side);
        block.levels[at] = {static_cast<float>(x / sides), static_cast<float>(y / sides),
                            static_cast<float>(1.0 / (sides * lattice.spacing)), 0.0f};
    }
    for (const LitChunk& lit : levels_.lit()) {
        const LatticePoint& from = eye_chunk[lit.key.level];
        table.add(lit.key.x - from.x, lit.key.y - from.y, lit.key.level, lit.layer);
    }
    std::memcpy(memory, &block, sizeof(block));
    std::memcpy(memory + kTableOffset, table.entries().data(), table_bytes);
    glTextureBufferRange(table_.name(), GL_RGBA32I, stream_.name(), kTableOffset,
                         static_cast<GLsizeiptr>(table_bytes));
    return {};
}

void GroundLight::bind() const {
    glBindTextureUnit(0, slopes_.name());
    glBindTextureUnit(4, nodes_.name());
    glBindBufferRange(GL_UNIFORM_BUFFER, 1, stream_.name(), 0, sizeof(LightBlock));
    glBindTextureUnit(5, table_.name());
}

void GroundLight::finish() { stream_.end(); }

std::size_t GroundLight::bytes() const { return kSlopeBytes * levels_.layer_count(); }

}  // namespace terrane::internal
