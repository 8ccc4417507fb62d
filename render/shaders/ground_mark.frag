// SPDX-License-Identifier: MIT
// The mark of a chunk: see TerrainRenderer::set_ground_marks().

flat in vec4 chunk_mark;  // rgb: colour, a: opacity

layout(location = 0) out vec4 colour_out;

void main() {
    // premultiplied: composited over the ground by shade.frag
    colour_out = vec4(chunk_mark.rgb, 1.0) * chunk_mark.a;
}
