// SPDX-License-Identifier: MIT
#include "gl/gl_object.h"

#include <terrane/render/offscreen.h>

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <system_error>
#include <vector>

// epoxy replaces the system's EGL header

namespace terrane {

struct GlContext::State {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    std::string renderer_name;
    internal::GlLog log;

    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    // the display stays initialised: another context of this process may use it, and EGL does not count references
    ~State() {
        if (context == EGL_NO_CONTEXT) return;
        if (eglGetCurrentContext() == context) {
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        }
        eglDestroyContext(display, context);
    }
};

namespace {

std::string error_text() {
    std::ostringstream text;
    text << "EGL error 0x" << std::hex << eglGetError();
    return text.str();
}

struct Candidate {
    std::string name;
    EGLDisplay display = EGL_NO_DISPLAY;
};

// Lists Mesa's surfaceless platform first, because it needs no device, then every device in EGL's order.
std::vector<Candidate> list_displays(std::string& trouble_out) {
    std::vector<Candidate> candidates;
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) {
        trouble_out = "EGL has no EGL_EXT_platform_base";
        return candidates;
    }
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
        candidates.push_back(
            {"surfaceless",
             eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA,
                                      static_cast<void*>(EGL_DEFAULT_DISPLAY), nullptr)});
    }
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") ||
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base")) {
        std::array<EGLDeviceEXT, 32> devices{};
        EGLint count = 0;
        if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) ==
            EGL_TRUE) {
            for (EGLint i = 0; i < count; ++i) {
                candidates.push_back(
                    {"device " + std::to_string(i),
                     eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT,
                                              devices[static_cast<std::size_t>(i)], nullptr)});
            }
        }
    }
    if (candidates.empty())
        trouble_out = "EGL offers neither the surfaceless nor a device platform";
    return candidates;
}

// Opens a context; returns "" or an error message.
std::string open_display(EGLDisplay display, GlChecks checks, EGLContext& context_out) {
    if (display == EGL_NO_DISPLAY) return "no display, " + error_text();
    EGLint major = 0, minor = 0;
    if (eglInitialize(display, &major, &minor) != EGL_TRUE) {
        return "cannot initialise, " + error_text();
    }
    if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context")) {
        return "no EGL_KHR_surfaceless_context";
    }
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return "no OpenGL, " + error_text();
    const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                       EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(display, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1) {
        return "no configuration with OpenGL, " + error_text();
    }
    const std::array<EGLint, 9> attributes{EGL_CONTEXT_MAJOR_VERSION,
                                           4,
                                           EGL_CONTEXT_MINOR_VERSION,
                                           5,
                                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                           EGL_CONTEXT_OPENGL_DEBUG,
                                           checks == GlChecks::on ? EGL_TRUE : EGL_FALSE,
                                           EGL_NONE};
    const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
    if (context == EGL_NO_CONTEXT) return "no OpenGL 4.5 core context, " + error_text();
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
        const std::string trouble = "cannot bind the context, " + error_text();
        eglDestroyContext(display, context);
        return trouble;
    }
    context_out = context;
    return {};
}

// Whether a context of EGL or GLX is current. GLX is not linked: a host that uses it has loaded it.
bool has_current_context() {
    if (eglGetCurrentContext() != EGL_NO_CONTEXT) return true;
    for (const char* const name : {"libGLX.so.0", "libGL.so.1"}) {
        void* const library = dlopen(name, RTLD_LAZY | RTLD_NOLOAD);
        if (library == nullptr) continue;
        // POSIX converts pointers of dlsym() to functions
        const auto current = reinterpret_cast<void* (*)()>(dlsym(library, "glXGetCurrentContext"));
        const bool is_current = current != nullptr && current() != nullptr;
        dlclose(library);
        if (is_current) return true;
    }
    return false;
}

}  // namespace

GlContext::GlContext(std::shared_ptr<State> state) : state_(std::move(state)) {}
GlContext::GlContext(GlContext&&) noexcept = default;
GlContext& GlContext::operator=(GlContext&&) noexcept = default;
GlContext::~GlContext() = default;

Result<GlContext> GlContext::create(GlChecks checks) {
    std::string troubles;
    for (const Candidate& candidate : list_displays(troubles)) {
        EGLContext context = EGL_NO_CONTEXT;
        const std::string trouble = open_display(candidate.display, checks, context);
        if (!trouble.empty()) {
            troubles += (troubles.empty() ? "" : "; ") + candidate.name + ": " + trouble;
            continue;
        }
        auto state = std::make_shared<State>();
        state->display = candidate.display;
        state->context = context;
        const GLubyte* const name = glGetString(GL_RENDERER);
        if (name == nullptr) {
            troubles += (troubles.empty() ? "" : "; ") + candidate.name +
                        ": its context does not give the name of its renderer";
            continue;
        }
        // OpenGL returns text as unsigned char
        state->renderer_name = reinterpret_cast<const char*>(name);
        if (checks == GlChecks::on) internal::attach_log(state->log);
        return GlContext(std::move(state));
    }
    return fail(ErrorCode::device_unavailable, "no OpenGL 4.5 device opens: " + troubles);
}

Result<GlContext> GlContext::adopt_current() {
    if (!has_current_context()) {
        return fail(ErrorCode::device_unavailable,
                    "no OpenGL context is current on the calling thread");
    }
    const int version = epoxy_gl_version();
    if (!epoxy_is_desktop_gl() || version < 45) {
        return fail(ErrorCode::device_unavailable,
                    std::string("the current context must be OpenGL 4.5 or later, got OpenGL ") +
                        (epoxy_is_desktop_gl() ? "" : "ES ") + std::to_string(version / 10) + "." +
                        std::to_string(version % 10));
    }
    auto state = std::make_shared<State>();
    // OpenGL returns text as unsigned char
    state->renderer_name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    return GlContext(std::move(state));
}

bool GlContext::is_adopted() const { return state_->context == EGL_NO_CONTEXT; }

void GlContext::make_current() {
    if (is_adopted()) return;
    eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context);
}

const std::string& GlContext::renderer_name() const { return state_->renderer_name; }

bool GlContext::is_software() const {
    constexpr std::array kNames = {"llvmpipe", "softpipe", "SwiftShader"};
    return std::any_of(kNames.begin(), kNames.end(), [&](const char* name) {
        return state_->renderer_name.find(name) != std::string::npos;
    });
}

std::shared_ptr<const void> GlContext::keep_alive() const { return state_; }

namespace {

// Largest number of pixels that read_png() accepts; the renderer writes no larger picture.
constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;

// Owns the memory of libpng's simplified interface.
struct PngImage {
    png_image png{};
    PngImage() { png.version = PNG_IMAGE_VERSION; }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
    ~PngImage() { png_image_free(&png); }
};

Result<void> check_image(const Image& image, const std::string& path) {
    if (image.width < 1 || image.height < 1 ||
        image.rgb.size() !=
            static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3) {
        return fail(ErrorCode::invalid_argument,
                    "cannot write " + path + ": a picture of " + std::to_string(image.width) +
                        " x " + std::to_string(image.height) + " pixels with " +
                        std::to_string(image.rgb.size()) + " bytes is none");
    }
    return {};
}

}  // namespace

Result<void> write_png(const Image& image, const std::string& path) {
    TERRANE_TRY(check_image(image, path));
    // a temporary file beside the final one, so that the rename stays on one file system
    const std::string part = path + ".part";
    const auto refuse = [&](const std::string& why) -> Result<void> {
        std::remove(part.c_str());
        return fail(ErrorCode::io, "cannot write " + path + ": " + why);
    };
    std::FILE* file = std::fopen(part.c_str(), "wb");
    if (file == nullptr) {
        return fail(ErrorCode::io, "cannot write " + path + ": " + std::strerror(errno));
    }
    PngImage out;
    out.png.width = static_cast<png_uint_32>(image.width);
    out.png.height = static_cast<png_uint_32>(image.height);
    out.png.format = PNG_FORMAT_RGB;
    // compresses faster; files are about a tenth larger
    out.png.flags = PNG_IMAGE_FLAG_FAST;
    const int is_written =
        png_image_write_to_stdio(&out.png, file, 0, image.rgb.data(), 0, nullptr);
    // a full disk may be reported only by the flush
    const bool is_flushed = std::fflush(file) == 0;
    const int flush_error = errno;
    std::fclose(file);
    if (is_written == 0) return refuse(static_cast<const char*>(out.png.message));
    if (!is_flushed) return refuse(std::strerror(flush_error));
    std::error_code error;
    std::filesystem::rename(part, path, error);
    if (error) return refuse(error.message());
    return {};
}

Result<Image> read_png(const std::string& path) {
    PngImage in;
    if (png_image_begin_read_from_file(&in.png, path.c_str()) == 0) {
        return fail(ErrorCode::io,
                    "cannot read " + path + ": " + static_cast<const char*>(in.png.message));
    }
    if (std::uint64_t{in.png.width} * in.png.height > kMaxPixels) {
        return fail(ErrorCode::io, "cannot read " + path + ": " + std::to_string(in.png.width) +
                                       " x " + std::to_string(in.png.height) +
                                       " pixels are too many");
    }
    in.png.format = PNG_FORMAT_RGB;
    Image image;
    image.width = static_cast<int>(in.png.width);
    image.height = static_cast<int>(in.png.height);
    image.rgb.resize(PNG_IMAGE_SIZE(in.png));
    const png_color black{0, 0, 0};
    if (png_image_finish_read(&in.png, &black, image.rgb.data(), 0, nullptr) == 0) {
        return fail(ErrorCode::io,
                    "cannot read " + path + ": " + static_cast<const char*>(in.png.message));
    }
    return image;
}

}  // namespace terrane
