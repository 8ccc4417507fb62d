// SPDX-License-Identifier: MIT
#include "light/ground_shade.h"

#include "gl/gl_object.h"
#include "gl/shader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace terrane::internal {

/// A periodic noise texture for the tint and fine bumps of the ground: red and green are slopes along x and y, blue is
/// the value, all with mean 1/2. Mipmaps fade the noise out with distance.
GlTexture make_ground_noise();

namespace {

constexpr int kSide = 256;  // texels

// Hash of the arguments, in [-1, 1].
double random_at(int column, int row, int octave) {
    std::uint32_t h = static_cast<std::uint32_t>(column) * 0x9e3779b1u ^
                      static_cast<std::uint32_t>(row) * 0x85ebca77u ^
                      static_cast<std::uint32_t>(octave) * 0xc2b2ae3du;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    h ^= h >> 15;
    return static_cast<double>(h) / 2147483647.5 - 1.0;
}

double smooth(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

// One octave of periodic value noise with `cells` cells per side.
double value_noise(int x, int y, int cells, int octave) {
    const int width = kSide / cells;
    const int column = x / width, row = y / width;
    const double u = smooth((x % width + 0.5) / width), v = smooth((y % width + 0.5) / width);
    const int next_column = (column + 1) % cells, next_row = (row + 1) % cells;
    const double south =
        std::lerp(random_at(column, row, octave), random_at(next_column, row, octave), u);
    const double north =
        std::lerp(random_at(column, next_row, octave), random_at(next_column, next_row, octave), u);
    return std::lerp(south, north, v);
}

std::uint8_t to_byte(double value) {
    return static_cast<std::uint8_t>(
        std::clamp(std::lround((value * 0.5 + 0.5) * 255.0), 0L, 255L));
}

}  // namespace

GlTexture make_ground_noise() {
    std::vector<double> values(std::size_t{kSide} * kSide);
    const auto index = [](int x, int y) {
        return static_cast<std::size_t>((y + kSide) % kSide) * kSide +
               static_cast<std::size_t>((x + kSide) % kSide);
    };
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            double sum = 0.0, amplitude = 0.42;
            for (int octave = 0, cells = 8; cells <= 128; ++octave, cells *= 2, amplitude *= 0.68) {
                sum += amplitude * value_noise(x, y, cells, octave);
            }
            values[index(x, y)] = sum;
        }
    }
    std::vector<std::uint8_t> texels(values.size() * 4);
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            std::uint8_t* texel = &texels[index(x, y) * 4];
            texel[0] = to_byte(1.2 * (values[index(x + 1, y)] - values[index(x - 1, y)]));
            texel[1] = to_byte(1.2 * (values[index(x, y + 1)] - values[index(x, y - 1)]));
            texel[2] = to_byte(values[index(x, y)]);
            texel[3] = 255;
        }
    }
    GlTexture texture = make_texture_2d();
    const GLuint name = texture.name();
    glTextureStorage2D(name, 9, GL_RGBA8, kSide, kSide);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(name, 0, 0, 0, kSide, kSide, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    glGenerateTextureMipmap(name);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    return texture;
}

namespace {

constexpr std::size_t kFirstLayers = 32;  // 4.4 MB
constexpr int kMostLayers = 2048;         // 278 MB; every device supports this many
constexpr std::size_t kLevels = 25;
constexpr std::size_t kSlopeTexels = std::size_t{kSlopeMapWidth} * kSlopeMapHeight;
constexpr int kNodesAlong = 3;
// Baseline of the bends by which the ground's materials know hollows, metres; 128 of the finest spacings, if these are
// smaller than a metre.
constexpr double kBroadBaseline = 128.0;

// The uniform block `Light` of shade.frag, in its std140 layout.
struct LightBlock {
    float root_spacing = 1.0f;
    std::int32_t finest_level = 0;
    std::int32_t mask = 0;
    std::int32_t broad_level = 0;
    std::array<std::array<float, 4>, kLevels> levels{};
};
static_assert(sizeof(LightBlock) == 16 + 16 * kLevels);

// Byte offset of the table in the buffer: a multiple of 256, the largest alignment that devices require.
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

GroundLight::GroundLight(bool has_bends)
    : has_bends_(has_bends), levels_(most_layers()), table_(make_texture_buffer()) {
    hold_layers(kFirstLayers);
}

// Grows the arrays, if necessary, to hold `count` layers, keeping their content.
void GroundLight::hold_layers(std::size_t count) {
    if (count <= layers_.size()) return;
    const std::size_t capacity = std::min<std::size_t>(std::bit_ceil(std::max(count, kFirstLayers)),
                                                       static_cast<std::size_t>(most_layers()));
    GlTexture slopes = make_layers(GL_RG16_SNORM, kSlopeMapWidth, kSlopeMapHeight, capacity);
    GlTexture bends;
    if (has_bends_) bends = make_layers(GL_R16_SNORM, kSlopeMapWidth, kSlopeMapHeight, capacity);
    GlTexture nodes = make_layers(GL_RG32F, kNodesAlong, kNodesAlong, capacity);
    if (!layers_.empty()) {
        const auto layer_count = static_cast<GLsizei>(layers_.size());
        glCopyImageSubData(slopes_.name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, slopes.name(),
                           GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, kSlopeMapWidth, kSlopeMapHeight,
                           layer_count);
        if (has_bends_) {
            glCopyImageSubData(bends_.name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, bends.name(),
                               GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, kSlopeMapWidth, kSlopeMapHeight,
                               layer_count);
        }
        glCopyImageSubData(nodes_.name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, nodes.name(),
                           GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, kNodesAlong, kNodesAlong, layer_count);
    }
    slopes_ = std::move(slopes);
    bends_ = std::move(bends);
    nodes_ = std::move(nodes);
    layers_.resize(capacity);
}

Result<void> GroundLight::prepare(const std::shared_ptr<const ResidentSet>& resident,
                                  const View& view, const EyeFrame& eye) {
    levels_.update(resident, view);
    upload(*resident);
    return write_table(resident->lattice(), eye);
}

// Uploads the slope maps and nodes that have changed.
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
            if (has_bends_) {
                glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
                const std::vector<std::int16_t> bends =
                    make_bend_map(resident, *lit.chunk, side_levels);
                glTextureSubImage3D(bends_.name(), 0, 0, 0, lit.layer, kSlopeMapWidth,
                                    kSlopeMapHeight, 1, GL_RED, GL_SHORT, bends.data());
                glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
            }
            layer.nodes[0].level = -1.0f;  // invalid: the nodes are those of another chunk
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
    const double broad = std::log2(lattice.level_spacing(0) / kBroadBaseline);
    block.broad_level =
        std::max(static_cast<int>(std::lround(broad)), lattice.finest_level - (kSlopeLayers - 1));
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
    if (has_bends_) glBindTextureUnit(13, bends_.name());
}

void GroundLight::finish() { stream_.end(); }

std::size_t GroundLight::bytes() const {
    return sizeof(std::int16_t) * (has_bends_ ? 3 : 2) * kSlopeTexels * levels_.layer_count();
}

namespace {

// Numbers of the classes of block.glsl, whose depths are a quarter of them.
constexpr int kBlockClasses = 4;

// Runs draw() so that its fragments write their depths.
template <class Draw>
void mark_with(const Draw& draw) {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_ALWAYS);
    draw();
}
// Runs draw() at the fragments that were marked with a depth.
template <class Draw>
void draw_marked(double depth, const Draw& draw) {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_EQUAL);
    glDepthMask(GL_FALSE);
    glDepthRange(depth, depth);
    draw();
    glDepthRange(0.0, 1.0);
    glDepthMask(GL_TRUE);
}

}  // namespace

std::string GroundShade::defines(bool has_overlay) const {
    return "#define SAMPLES " + std::to_string(sample_count_) + "\n#define OVERLAY " +
           (has_overlay ? "1" : "0") + "\n#define SMOOTHED " + (is_smoothed_ ? "1" : "0") +
           "\n#define PIXELS " + (has_blocks_ ? "4\n" : "1\n");
}

Result<GroundShade::Programs> GroundShade::make_programs(const std::string& lighting) const {
    Programs made;
    for (const bool has_overlay : {false, true}) {
        std::vector<GlProgram>& programs = has_overlay ? made.with_overlay : made.plain;
        for (int blocks = 0; blocks < (has_blocks_ ? kBlockClasses : 1); ++blocks) {
            std::string text = defines(has_overlay);
            if (has_blocks_) {
                text += std::string(block_glsl) + "#define BLOCKS " + std::to_string(blocks) + "\n";
            }
            TERRANE_TRY(GlProgram program, make_program("the light", shade_vert,
                                                        text + lighting + std::string(shade_frag)));
            programs.push_back(std::move(program));
        }
    }
    return made;
}

Result<GroundShade> GroundShade::create(int sample_count, const std::string& lighting,
                                        bool is_smoothed, bool has_materials) {
    GroundShade made;
    made.light_ = std::make_unique<GroundLight>(has_materials);
    const bool has_blocks = has_materials && sample_count == 1;
    made.sample_count_ = sample_count;
    made.is_smoothed_ = is_smoothed;
    made.has_blocks_ = has_blocks;
    TERRANE_TRY(made.programs_, made.make_programs(lighting));
    const std::string block_text = std::string(block_glsl);
    for (const bool has_overlay : {false, true}) {
        if (!has_blocks) break;
        TERRANE_TRY(GlProgram classes,
                    make_program("the blocks", shade_vert,
                                 made.defines(has_overlay) + block_text + std::string(block_frag)));
        (has_overlay ? made.classes_with_overlay_ : made.classes_) = std::move(classes);
    }
    const std::string of_blocks = has_blocks ? "#define BLOCKS\n" + block_text : std::string();
    if (has_blocks || is_smoothed) {
        TERRANE_TRY(GlProgram copying,
                    make_program("the picture", shade_vert, of_blocks + std::string(smooth_frag)));
        made.copying_ = std::move(copying);
    }
    if (is_smoothed) {
        TERRANE_TRY(GlProgram smoothing,
                    make_program("the smooth edges", shade_vert,
                                 of_blocks + "#define EDGES\n" + std::string(smooth_frag)));
        made.smoothing_ = std::move(smoothing);
    }
    made.noise_ = make_ground_noise();
    made.no_layout_ = make_vertex_array();
    return made;
}

void GroundShade::draw(const Framebuffer& picture, bool has_overlay) const {
    picture.bind_colours();
    glDisable(GL_DEPTH_TEST);
    light_->bind();
    glBindTextureUnit(1, noise_.name());
    glBindTextureUnit(2, picture.depth_texture());
    glBindTextureUnit(3, picture.overlay_texture());
    const std::vector<GlProgram>& programs = has_overlay ? programs_.with_overlay : programs_.plain;
    glBindVertexArray(no_layout_.name());
    const auto draw_with = [](const GlProgram& program) {
        glUseProgram(program.name());
        glDrawArrays(GL_TRIANGLES, 0, 3);
    };
    if (picture.has_blocks()) {
        glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        mark_with([&] { draw_with(has_overlay ? classes_with_overlay_ : classes_); });
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        for (std::size_t blocks = 0; blocks < programs.size(); ++blocks)
            draw_marked(0.25 * static_cast<double>(blocks), [&] { draw_with(programs[blocks]); });
        glDisable(GL_DEPTH_TEST);
    } else {
        draw_with(programs[0]);
    }
    if (!picture.has_blocks() && !picture.is_smoothed()) return;
    picture.bind_smoothed();
    glBindTextureUnit(0, picture.shaded_texture());
    glBindTextureUnit(1, picture.block_classes());
    if (!picture.is_smoothed()) {
        draw_with(copying_);
        return;
    }
    // pixels on edges get the depth 1
    mark_with([&] { draw_with(copying_); });
    draw_marked(1.0, [&] { draw_with(smoothing_); });
    glDisable(GL_DEPTH_TEST);
}

}  // namespace terrane::internal
