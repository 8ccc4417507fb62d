// SPDX-License-Identifier: MIT
// Classifies blocks of two by two pixels by the depths of their pixels and of those beside them. OVERLAY (whether there
// is one) is defined by the program.

layout(binding = 2) uniform sampler2D depths;
layout(binding = 3) uniform sampler2D overlays;

// Bend of the depth over four pixels, relative to the depth, up to which they are on one surface: the depth of a plane
// is linear over the picture.
const float kOneSurface = 0.03;
// Size of near ground's pixels, relative to the spacing of the finest samples.
const float kNearShare = 0.5;
// Share of the length of long pixels that counts as their size.
const float kLongShare = 0.25;

void main() {
    ivec2 last = textureSize(depths, 0) - 1;
    ivec2 first = pixel_of(ivec2(gl_FragCoord.xy), 0);
    float most = 0.0, bend = 0.0, step_along = 0.0;
    for (int i = 0; i < 2; ++i) {
        for (int axis = 0; axis < 2; ++axis) {
            ivec2 start = first + i * ivec2(axis, 1 - axis), along = ivec2(1 - axis, axis);
            float depth[4];
            for (int j = 0; j < 4; ++j) {
                depth[j] = texelFetch(depths, clamp(start + (j - 1) * along, ivec2(0), last), 0).x;
                most = max(most, depth[j]);
            }
            step_along = max(step_along, abs(depth[2] - depth[1]));
            bend = max(bend, max(abs(depth[0] + depth[2] - 2.0 * depth[1]), abs(depth[1] + depth[3] - 2.0 * depth[2])));
        }
    }
    bool is_split = bend > kOneSurface * most;
#if OVERLAY
    for (int i = 0; i < 4; ++i)
        is_split = is_split || texelFetch(overlays, min(pixel_of(ivec2(gl_FragCoord.xy), i), last), 0).a > 0.0;
#endif
    // size of a pixel on the ground, as in shade.frag
    vec2 place = (vec2(first) + 1.0) * 2.0 / vec2(last + 1) - 1.0;
    vec3 towards = frame.forward.xyz + place.x * frame.right.xyz + place.y * frame.up.xyz;
    float span = length(towards);
    float footprint = frame.near.x / most * span * frame.grid.w * inversesqrt(max(abs(towards.z) / span, 0.10));
    // towards the horizon a pixel is long
    float length_m = frame.near.x / most * span * step_along / most;
    int ground = max(footprint, kLongShare * length_m) < kNearShare * frame.grid.x ? NEAR_BLOCKS : FAR_BLOCKS;
    gl_FragDepth = depth_of_class(is_split ? MIXED_BLOCKS : (most == 0.0 ? SKY_BLOCKS : ground));
}
