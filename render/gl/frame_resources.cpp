// SPDX-License-Identifier: MIT
#include "gl/frame_resources.h"

#include "gl/gl_object.h"

#include <algorithm>
#include <array>
#include <string>

namespace terrane::internal {
namespace {

// A picture of this size with 4 samples per pixel takes 2 GiB for colour and depth.
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;

Result<void> check_size(int width_px, int height_px) {
    GLint side = 0;
    std::array<GLint, 2> viewport{};
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &side);
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
    const std::string got = std::to_string(width_px) + " x " + std::to_string(height_px);
    if (width_px < 1 || height_px < 1) {
        return fail(ErrorCode::invalid_argument,
                    "the picture must have at least 1 x 1 pixels, got " + got);
    }
    if (width_px > std::min(side, viewport[0]) || height_px > std::min(side, viewport[1])) {
        return fail(ErrorCode::invalid_argument,
                    "the device draws at most " + std::to_string(std::min(side, viewport[0])) +
                        " x " + std::to_string(std::min(side, viewport[1])) + " pixels, got " +
                        got);
    }
    if (std::int64_t{width_px} * height_px > kMaxPixels) {
        return fail(
            ErrorCode::invalid_argument,
            "the picture must have at most " + std::to_string(kMaxPixels) + " pixels, got " + got);
    }
    return {};
}

// Pixels of a block, and blocks along a side of the picture.
constexpr int kBlockPixels = 4;
int blocks_along(int pixels) { return (pixels + 1) / 2; }

// A plain texture for 1 sample, else a multisample texture.
GlTexture make_samples(GLenum format, int width_px, int height_px, int samples) {
    if (samples == 1) {
        GlTexture texture = make_texture_2d();
        glTextureStorage2D(texture.name(), 1, format, width_px, height_px);
        glTextureParameteri(texture.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(texture.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        return texture;
    }
    GlTexture texture = make_texture_2d_samples();
    glTextureStorage2DMultisample(texture.name(), samples, format, width_px, height_px, GL_TRUE);
    return texture;
}

int count_samples(const GlTexture& texture) {
    GLint samples = 0;
    glGetTextureLevelParameteriv(texture.name(), 0, GL_TEXTURE_SAMPLES, &samples);
    return std::max(samples, 1);
}

}  // namespace

Result<Framebuffer> Framebuffer::create(int width_px, int height_px, int wanted_samples,
                                        bool smooths_edges, bool has_blocks) {
    TERRANE_TRY(check_size(width_px, height_px));
    GLint colour_samples = 1, depth_samples = 1;
    glGetIntegerv(GL_MAX_COLOR_TEXTURE_SAMPLES, &colour_samples);
    glGetIntegerv(GL_MAX_DEPTH_TEXTURE_SAMPLES, &depth_samples);

    Framebuffer made;
    made.width_px_ = width_px;
    made.height_px_ = height_px;
    made.colours_ = make_renderbuffer();
    glNamedRenderbufferStorage(made.colours_.name(), GL_RGBA8, width_px, height_px);
    made.picture_ = make_framebuffer();
    glNamedFramebufferRenderbuffer(made.picture_.name(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                   made.colours_.name());
    GLenum status = glCheckNamedFramebufferStatus(made.picture_.name(), GL_FRAMEBUFFER);

    GLenum drawn_status = GL_FRAMEBUFFER_UNSUPPORTED;
    for (int samples = std::min({wanted_samples, colour_samples, depth_samples}); samples >= 1;
         samples /= 2) {
        made.depth_ = make_samples(GL_DEPTH_COMPONENT32F, width_px, height_px, samples);
        made.overlay_ = make_samples(GL_RGBA8, width_px, height_px, samples);
        made.sample_count_ = count_samples(made.depth_);
        made.depth_target_ = make_framebuffer();
        made.overlay_target_ = make_framebuffer();
        for (const GlFramebuffer* target : {&made.depth_target_, &made.overlay_target_}) {
            glNamedFramebufferTexture(target->name(), GL_DEPTH_ATTACHMENT, made.depth_.name(), 0);
        }
        glNamedFramebufferDrawBuffer(made.depth_target_.name(), GL_NONE);
        glNamedFramebufferTexture(made.overlay_target_.name(), GL_COLOR_ATTACHMENT0,
                                  made.overlay_.name(), 0);
        made.overlay_alone_ = make_framebuffer();
        glNamedFramebufferTexture(made.overlay_alone_.name(), GL_COLOR_ATTACHMENT0,
                                  made.overlay_.name(), 0);
        drawn_status = glCheckNamedFramebufferStatus(made.depth_target_.name(), GL_FRAMEBUFFER);
        if (drawn_status == GL_FRAMEBUFFER_COMPLETE) {
            drawn_status =
                glCheckNamedFramebufferStatus(made.overlay_target_.name(), GL_FRAMEBUFFER);
        }
        if (drawn_status == GL_FRAMEBUFFER_COMPLETE) break;
    }
    if (made.sample_count_ == 1) made.add_shaded(smooths_edges, has_blocks);
    TERRANE_TRY(check_gl("make the picture"));
    if (status == GL_FRAMEBUFFER_COMPLETE) status = drawn_status;
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        return fail(ErrorCode::device_unavailable,
                    "the device offers no picture of 8-bit colour and 32-bit depth, status " +
                        std::to_string(status));
    }
    made.bind_smoothed();
    glClearColor(0.0f, 0.0f, 0.0f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT);
    return made;
}

// Adds what the shading pass draws into if another pass follows it.
void Framebuffer::add_shaded(bool smooths_edges, bool has_blocks) {
    is_smoothed_ = smooths_edges;
    if (smooths_edges) {
        edges_ = make_renderbuffer();
        glNamedRenderbufferStorage(edges_.name(), GL_DEPTH_COMPONENT32F, width_px_, height_px_);
        glNamedFramebufferRenderbuffer(picture_.name(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                                       edges_.name());
    }
    if (!smooths_edges && !has_blocks) return;
    shaded_target_ = make_framebuffer();
    if (!has_blocks) {
        shaded_ = make_samples(GL_RGBA8, width_px_, height_px_, 1);
        glNamedFramebufferTexture(shaded_target_.name(), GL_COLOR_ATTACHMENT0, shaded_.name(), 0);
        return;
    }
    const int width = blocks_along(width_px_), height = blocks_along(height_px_);
    shaded_ = make_texture_2d_array();
    glTextureStorage3D(shaded_.name(), 1, GL_RGBA8, width, height, kBlockPixels);
    std::array<GLenum, kBlockPixels> targets{};
    for (int layer = 0; layer < kBlockPixels; ++layer) {
        const GLenum target = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(layer);
        glNamedFramebufferTextureLayer(shaded_target_.name(), target, shaded_.name(), 0, layer);
        targets[static_cast<std::size_t>(layer)] = target;
    }
    glNamedFramebufferDrawBuffers(shaded_target_.name(), kBlockPixels, targets.data());
    block_classes_ = make_samples(GL_DEPTH_COMPONENT32F, width, height, 1);
    glNamedFramebufferTexture(shaded_target_.name(), GL_DEPTH_ATTACHMENT, block_classes_.name(), 0);
}

void Framebuffer::bind(const GlFramebuffer& target) const {
    glBindFramebuffer(GL_FRAMEBUFFER, target.name());
    glViewport(0, 0, width_px_, height_px_);
}
void Framebuffer::bind_overlay() const { bind(overlay_alone_); }
void Framebuffer::bind_depth() const { bind(depth_target_); }
void Framebuffer::bind_depth_and_overlay() const { bind(overlay_target_); }
void Framebuffer::bind_colours() const {
    bind(shaded_.name() != 0 ? shaded_target_ : picture_);
    if (has_blocks()) glViewport(0, 0, blocks_along(width_px_), blocks_along(height_px_));
}
void Framebuffer::bind_smoothed() const { bind(picture_); }

Image Framebuffer::read() const {
    Image image;
    image.width = width_px_;
    image.height = height_px_;
    const std::size_t row_bytes = static_cast<std::size_t>(width_px_) * 3;
    image.rgb.resize(row_bytes * static_cast<std::size_t>(height_px_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, picture_.name());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width_px_, height_px_, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
    // row 0 is the bottom in OpenGL
    for (std::size_t low = 0, high = static_cast<std::size_t>(height_px_) - 1; low < high;
         ++low, --high) {
        std::swap_ranges(image.rgb.begin() + static_cast<std::ptrdiff_t>(low * row_bytes),
                         image.rgb.begin() + static_cast<std::ptrdiff_t>((low + 1) * row_bytes),
                         image.rgb.begin() + static_cast<std::ptrdiff_t>(high * row_bytes));
    }
    return image;
}

void Framebuffer::copy_to(GLuint framebuffer, int x, int y, int width_px, int height_px) const {
    const bool is_scaled = width_px != width_px_ || height_px != height_px_;
    glBlitNamedFramebuffer(picture_.name(), framebuffer, 0, 0, width_px_, height_px_, x, y,
                           x + width_px, y + height_px, GL_COLOR_BUFFER_BIT,
                           is_scaled ? GL_LINEAR : GL_NEAREST);
}

StreamBuffer::~StreamBuffer() {
    for (Turn& turn : turns_) {
        if (turn.fence != nullptr) glDeleteSync(turn.fence);
    }
}

void StreamBuffer::wait(Turn& turn) {
    if (turn.fence == nullptr) return;
    constexpr GLuint64 kOneSecond = 1'000'000'000;
    // the loop also ends if the wait fails: a lost context never signals a fence
    while (glClientWaitSync(turn.fence, GL_SYNC_FLUSH_COMMANDS_BIT, kOneSecond) ==
           GL_TIMEOUT_EXPIRED) {
    }
    glDeleteSync(turn.fence);
    turn.fence = nullptr;
}

std::byte* StreamBuffer::begin(std::size_t bytes) {
    turn_ = (turn_ + 1) % turns_.size();
    Turn& turn = turns_[turn_];
    wait(turn);
    if (turn.bytes >= bytes) return turn.memory;
    // 1.5 times the requested size, so that a slowly growing mesh rarely needs a new buffer
    const std::size_t wanted = bytes + bytes / 2;
    constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    turn.buffer = make_buffer();
    glNamedBufferStorage(turn.buffer.name(), static_cast<GLsizeiptr>(wanted), nullptr, kAccess);
    turn.memory = static_cast<std::byte*>(
        glMapNamedBufferRange(turn.buffer.name(), 0, static_cast<GLsizeiptr>(wanted), kAccess));
    turn.bytes = turn.memory == nullptr ? 0 : wanted;
    return turn.memory;
}

void StreamBuffer::end() { turns_[turn_].fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0); }

// Reads the finished queries, oldest first.
void GpuTimer::collect() {
    for (std::size_t i = 1; i <= turns_.size(); ++i) {
        Turn& turn = turns_[(turn_ + i) % turns_.size()];
        if (!turn.is_pending) continue;
        GLint is_available = 0;
        glGetQueryObjectiv(turn.last.name(), GL_QUERY_RESULT_AVAILABLE, &is_available);
        if (is_available == GL_FALSE) return;
        GLuint64 first = 0, last = 0;
        glGetQueryObjectui64v(turn.first.name(), GL_QUERY_RESULT, &first);
        glGetQueryObjectui64v(turn.last.name(), GL_QUERY_RESULT, &last);
        last_ms_ = 1e-6 * static_cast<double>(last - first);
        turn.is_pending = false;
    }
}

void GpuTimer::begin() {
    collect();
    Turn& next = turns_[(turn_ + 1) % turns_.size()];
    is_active_ = !next.is_pending;
    if (!is_active_) return;
    turn_ = (turn_ + 1) % turns_.size();
    for (GlQuery* query : {&next.first, &next.last}) {
        if (query->name() != 0) continue;
        GLuint name = 0;
        glCreateQueries(GL_TIMESTAMP, 1, &name);
        *query = GlQuery(name);
    }
    glQueryCounter(next.first.name(), GL_TIMESTAMP);
}

void GpuTimer::end() {
    if (!is_active_) return;
    glQueryCounter(turns_[turn_].last.name(), GL_TIMESTAMP);
    turns_[turn_].is_pending = true;
    is_active_ = false;
}

}  // namespace terrane::internal
