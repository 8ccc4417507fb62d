// SPDX-License-Identifier: MIT
// Scene files: parsed, their volumes placed on a coarse fractal, and their surface asked.
#include "scene/terrain_options.h"
#include "support/input.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/surface.h>

using namespace terrane;

namespace {

constexpr std::string_view kCube =
    "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 4\nv 4 0 4\nv 4 4 4\nv 0 4 4\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Whether a scene can name files beyond its folder.
bool leaves_folder(std::string_view text) {
    return text.find('/') != std::string_view::npos || text.find("\\u00") != std::string_view::npos;
}

std::shared_ptr<const HeightSource> make_ground() {
    const FractalSettings settings{.seed = 7, .octave_count = 4, .finest_spacing_log2 = 4};
    return FractalHeights::create(settings).value();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFolder folder;
    static const std::string cube = folder.write("cube.obj", kCube);
    static const std::shared_ptr<const HeightSource> ground = make_ground();
    fuzz::Input input(data, size);
    const std::string text(input.rest_as_text());
    if (leaves_folder(text)) return -1;
    const auto options = tools::parse_scene(text, folder.path() + "/scene.json");
    if (!fuzz::is_accepted(options)) return 0;
    fuzz::require(options->seed || !options->dem.empty(), "a scene names a terrain");
    if (options->volumes != nullptr) {
        const auto placed = tools::place_volumes(*options->volumes, *ground);
        if (placed) {
            fuzz::require(tools::describe_volumes(**placed).is_array(), "volumes are described");
        }
    }
    if (options->surface && options->surface->raster.empty()) {
        const auto surface = tools::open_surface(*options->surface, nullptr);
        if (surface) {
            const SurfaceProperties properties = (*surface)->at(1.0, -2.0);
            fuzz::require(properties.validate().has_value(), "surface properties are in range");
        }
    }
    return 0;
}
