// SPDX-License-Identifier: MIT
// Two passes over a shaded picture with one sample per pixel. The first one copies it, and marks pixels on edges with
// the depth 1. With EDGES, the second one smooths these: the position on the edge between its two ends tells how far to
// look beside the pixel.
//
// BLOCKS is defined if the shaded picture has the form of block.glsl. Edges are then those of surfaces and objects:
// textures of the ground are smooth already.
//
// Source:    T. Lottes. FXAA. NVIDIA 2009; version 3.
// Deviation: luma comes from the shading pass, in alpha.

#ifdef BLOCKS
layout(binding = 0) uniform sampler2DArray shaded;
layout(binding = 1) uniform sampler2D classes;
vec4 shaded_at(ivec2 pixel) { return texelFetch(shaded, place_of(pixel), 0); }
ivec2 picture_size() { return 2 * textureSize(shaded, 0).xy; }
#else
layout(binding = 0) uniform sampler2D shaded;  // rgb as displayed, a: luma
vec4 shaded_at(ivec2 pixel) { return texelFetch(shaded, pixel, 0); }
ivec2 picture_size() { return textureSize(shaded, 0); }
#endif

layout(location = 0) out vec4 colour_out;

// Contrast of an edge, of luma and relative to the neighbourhood's largest luma.
const float kLeastContrast = 0.04, kContrast = 0.125;
// Largest share of details of a pixel that is blended away.
const float kBlend = 0.6;
// Pixels along an edge that are looked at.
const int kSteps = 12;
const int kStep[kSteps] = int[](1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 20);

float luma_at(ivec2 pixel) { return shaded_at(clamp(pixel, ivec2(0), picture_size() - 1)).a; }

// Luma of a pixel and its neighbours.
struct Cross {
    float centre, north, south, east, west;
};
Cross cross_at(ivec2 pixel) {
    return Cross(luma_at(pixel), luma_at(pixel + ivec2(0, 1)), luma_at(pixel - ivec2(0, 1)),
                 luma_at(pixel + ivec2(1, 0)), luma_at(pixel - ivec2(1, 0)));
}
// Largest difference of luma, and whether it is that of an edge.
float range_of(Cross here, out bool is_edge) {
    float least = min(min(min(here.north, here.south), min(here.east, here.west)), here.centre);
    float most = max(max(max(here.north, here.south), max(here.east, here.west)), here.centre);
    is_edge = most - least >= max(kLeastContrast, kContrast * most);
    return most - least;
}

#ifdef EDGES
// Pixels along an edge to its end in a direction, and the excess of luma over the edge's there. across: to the pixel on
// the other side
vec2 end_of_edge(ivec2 pixel, ivec2 across, ivec2 along, float edge, float gradient) {
    vec2 end = vec2(0.0);
    bool is_found = false;
    for (int i = 0; i < kSteps; ++i) {
        ivec2 at = pixel + kStep[i] * along;
        float excess = 0.5 * (luma_at(at) + luma_at(at + across)) - edge;
        end = is_found ? end : vec2(float(kStep[i]), excess);
        is_found = is_found || abs(excess) >= gradient;
    }
    return end;
}

void main() {
    // fetches instead of filtered or gathering lookups, which take a software rasteriser several times as long
    ivec2 place = ivec2(gl_FragCoord.xy);
    Cross here = cross_at(place);
    bool is_edge;
    float range = range_of(here, is_edge);
    float north_east = luma_at(place + 1), south_west = luma_at(place - 1);
    float north_west = luma_at(place + ivec2(-1, 1)), south_east = luma_at(place + ivec2(1, -1));
    float across_rows = abs(north_west + south_west - 2.0 * here.west) +
                        2.0 * abs(here.north + here.south - 2.0 * here.centre) +
                        abs(north_east + south_east - 2.0 * here.east);
    float across_columns = abs(north_west + north_east - 2.0 * here.north) +
                           2.0 * abs(here.east + here.west - 2.0 * here.centre) +
                           abs(south_west + south_east - 2.0 * here.south);
    bool is_level = across_rows >= across_columns;
    float before = is_level ? here.south : here.west, after = is_level ? here.north : here.east;
    bool is_after = abs(after - here.centre) >= abs(before - here.centre);
    float beside = is_after ? after : before;
    ivec2 along = is_level ? ivec2(1, 0) : ivec2(0, 1);
    ivec2 across = (is_after ? 1 : -1) * along.yx;

    float edge = 0.5 * (here.centre + beside), gradient = 0.25 * abs(beside - here.centre);
    vec2 backward = end_of_edge(place, across, -along, edge, gradient);
    vec2 forward = end_of_edge(place, across, along, edge, gradient);
    vec2 nearer = backward.x < forward.x ? backward : forward;
    // the edge leaves the pixel's side where the nearer end is on the other side of the edge's luma
    bool crosses = (nearer.y < 0.0) != (here.centre < edge);
    float shift = crosses ? 0.5 - nearer.x / (backward.x + forward.x) : 0.0;

    float mean = (2.0 * (here.north + here.east + here.south + here.west) + north_east + north_west + south_east +
                  south_west) / 12.0;
    float detail = smoothstep(0.0, 1.0, min(abs(mean - here.centre) / max(range, 1e-6), 1.0));
    shift = is_edge ? max(shift, kBlend * detail * detail) : 0.0;
    ivec2 other = clamp(place + across, ivec2(0), picture_size() - 1);
    colour_out = vec4(mix(shaded_at(place).rgb, shaded_at(other).rgb, shift), 1.0);
}
#else
void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    colour_out = vec4(shaded_at(place).rgb, 1.0);
#ifdef BLOCKS
    gl_FragDepth = has_edges(texelFetch(classes, place >> 1, 0).x) ? 1.0 : 0.0;
#else
    bool is_edge;
    range_of(cross_at(place), is_edge);
    gl_FragDepth = is_edge ? 1.0 : 0.0;
#endif
}
#endif
