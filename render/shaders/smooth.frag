// SPDX-License-Identifier: MIT
// Smooths the edges of a picture with one sample per pixel: at a pixel on an edge, the position on the edge between its
// two ends tells how far to sample beside the pixel.
//
// Source:    T. Lottes. FXAA. NVIDIA 2009; version 3.
// Deviation: luma comes from the shading pass, in alpha.

layout(binding = 0) uniform sampler2D shaded;  // rgb as displayed, a: luma

layout(location = 0) out vec4 colour_out;

// Contrast of an edge, of luma and relative to the neighbourhood's largest luma.
const float kLeastContrast = 0.04, kContrast = 0.125;
// Largest share of details of a pixel that is blended away.
const float kBlend = 0.6;
// Pixels between successive samples along an edge.
const int kSteps = 8;
const float kStep[kSteps] = float[](1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 4.0, 8.0);

float luma_at(vec2 at) { return textureLod(shaded, at, 0.0).a; }

// Pixels from a place on an edge to its end in a direction, at most 20.5, and the excess of luma over the edge's there.
vec2 end_of_edge(vec2 at, vec2 along, float edge, float gradient) {
    float distance = 0.0, excess = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        distance += kStep[i];
        excess = luma_at(at + distance * along) - edge;
        if (abs(excess) >= gradient) break;
    }
    return vec2(distance, excess);
}

void main() {
    // fetches instead of filtered or gathering lookups, which take a software rasteriser several times as long
    ivec2 place = ivec2(gl_FragCoord.xy), last = textureSize(shaded, 0) - 1;
    ivec2 low = max(place - 1, 0), high = min(place + 1, last);
    vec4 centre = texelFetch(shaded, place, 0);
    float north = texelFetch(shaded, ivec2(place.x, high.y), 0).a;
    float south = texelFetch(shaded, ivec2(place.x, low.y), 0).a;
    float east = texelFetch(shaded, ivec2(high.x, place.y), 0).a;
    float west = texelFetch(shaded, ivec2(low.x, place.y), 0).a;
    float least = min(min(min(north, south), min(east, west)), centre.a);
    float most = max(max(max(north, south), max(east, west)), centre.a);
    float range = most - least;
    vec3 colour = centre.rgb;
    // a loop instead of a branch: a software rasteriser executes both sides of a branch
    for (int left = range >= max(kLeastContrast, kContrast * most) ? 1 : 0; left > 0; --left) {
        vec2 pixel = 1.0 / vec2(last + 1);
        vec2 at = gl_FragCoord.xy * pixel;
        float north_east = texelFetch(shaded, high, 0).a;
        float north_west = texelFetch(shaded, ivec2(low.x, high.y), 0).a;
        float south_east = texelFetch(shaded, ivec2(high.x, low.y), 0).a;
        float south_west = texelFetch(shaded, low, 0).a;
        float across_rows = abs(north_west + south_west - 2.0 * west) +
                            2.0 * abs(north + south - 2.0 * centre.a) +
                            abs(north_east + south_east - 2.0 * east);
        float across_columns = abs(north_west + north_east - 2.0 * north) +
                               2.0 * abs(west + east - 2.0 * centre.a) +
                               abs(south_west + south_east - 2.0 * south);
        bool is_level = across_rows >= across_columns;
        float before = is_level ? south : west, after = is_level ? north : east;
        bool is_after = abs(after - centre.a) >= abs(before - centre.a);
        float beside = is_after ? after : before;
        vec2 across = (is_after ? 1.0 : -1.0) * (is_level ? vec2(0.0, pixel.y) : vec2(pixel.x, 0.0));
        vec2 along = is_level ? vec2(pixel.x, 0.0) : vec2(0.0, pixel.y);

        float edge = 0.5 * (centre.a + beside), gradient = 0.25 * abs(beside - centre.a);
        vec2 start = at + 0.5 * across;
        vec2 backward = end_of_edge(start, -along, edge, gradient);
        vec2 forward = end_of_edge(start, along, edge, gradient);
        vec2 nearer = backward.x < forward.x ? backward : forward;
        // the edge leaves the pixel's side where the nearer end is on the other side of the edge's luma
        bool crosses = (nearer.y < 0.0) != (centre.a < edge);
        float shift = crosses ? 0.5 - nearer.x / (backward.x + forward.x) : 0.0;

        float mean = (2.0 * (north + east + south + west) + north_east + north_west + south_east +
                      south_west) / 12.0;
        float detail = smoothstep(0.0, 1.0, min(abs(mean - centre.a) / range, 1.0));
        shift = max(shift, kBlend * detail * detail);
        colour = textureLod(shaded, at + shift * across, 0.0).rgb;
    }
    colour_out = vec4(colour, 1.0);
}
