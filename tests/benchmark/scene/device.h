// SPDX-License-Identifier: MIT
#pragma once

#include "benchmark/bench.h"

#include <terrane/render/terrain_renderer.h>

namespace terrane::bench {

/// A device for drawing. Ends the program, as a success, where none can be opened.
inline GlContext open_device() {
    Result<GlContext> context = GlContext::create();
    if (context) return std::move(*context);
    std::printf("skipped: %s\n", context.error().message.c_str());
    std::exit(0);
}

/// A renderer with one sample a pixel.
inline TerrainRenderer make_renderer(GlContext& context, int width, int height) {
    RendererSettings settings;
    settings.sample_count = 1;
    return value_or_exit(TerrainRenderer::create(context, width, height, settings));
}

/// Draws objects without terrain, and waits for the picture.
inline void draw_objects(TerrainRenderer& renderer, const View& view, const SceneDraws& draws) {
    value_or_exit(renderer.draw({}, view, draws));
    renderer.read();
}

}  // namespace terrane::bench
