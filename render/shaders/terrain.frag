// SPDX-License-Identifier: MIT

layout(binding = 0) uniform sampler2DArray slopes;  // see slope_map.h
layout(binding = 1) uniform sampler2D noise;        // see ground_noise.h

in vec3 p_eye;
in vec2 cell;
in vec2 tile_m;
in float height_m;
flat in vec2 map;         // x: slope map, y: metres between samples
flat in vec4 side_layer;  // least layer of the slopes at the west, east, south, north edge

layout(location = 0) out vec4 colour_out;

const int kLastLayer = 7;
// Layers finer than what suits a pixel's longer side: at grazing angles that would be a blur.
const float kSharper = -1.2;

vec2 slope_at(int layer) {
    float row = float(256 - (256 >> layer) + layer);
    vec2 texel = cell / float(1 << layer) + vec2(0.5, row + 0.5);
    return textureLod(slopes, vec3(texel / vec2(129.0, 263.0), map.x), 0.0).xy;
}

// The ground's normal at the size of this pixel. Depends on distance and direction alone, so that
// neither triangles nor chunks show in the light.
vec3 ground_normal(float distance, vec3 along) {
    float pixel_m = distance * frame.grid.w * inversesqrt(max(abs(along.z), 0.10));
    vec4 inside = vec4(cell, 128.0 - cell);  // west, south, east, north
    vec4 fade = side_layer * (1.0 - smoothstep(0.0, 16.0, inside.xzyw));
    float least = max(max(fade.x, fade.y), max(fade.z, fade.w));
    float wanted = clamp(max(log2(pixel_m / map.y), least), 0.0, float(kLastLayer));
    int layer = min(int(wanted), kLastLayer - 1);
    vec2 slope = mix(slope_at(layer), slope_at(layer + 1), wanted - float(layer));
    return vec3(slope, sqrt(max(1.0 - dot(slope, slope), 0.0)));
}

void main() {
    float distance = length(p_eye);
    vec3 along = p_eye / distance;
    vec3 normal = ground_normal(distance, along);

    // fades before its period shows
    vec3 fine = (texture(noise, tile_m * frame.tint.z, kSharper).xyz - 0.5) * exp2(-distance / 220.0);
    // turned, so that the two periods do not line up
    vec2 turned = vec2(3.0 * tile_m.x + 4.0 * tile_m.y, 3.0 * tile_m.y - 4.0 * tile_m.x);
    vec3 coarse = texture(noise, turned * frame.tint.w, kSharper).xyz - 0.5;

    float high = (height_m - frame.tint.x) * frame.tint.y + 0.16 * coarse.z + 0.05 * fine.z;
    float steep = 1.0 - normal.z + 0.10 * coarse.z + 0.12 * fine.z;

    const vec3 meadow = vec3(0.135, 0.150, 0.060);
    const vec3 forest = vec3(0.052, 0.072, 0.036);
    const vec3 heath = vec3(0.200, 0.170, 0.105);
    const vec3 scree = vec3(0.290, 0.265, 0.235);
    const vec3 rock = vec3(0.165, 0.150, 0.138);
    const vec3 snow = vec3(0.82, 0.86, 0.92);
    vec3 green = mix(meadow, forest, smoothstep(-0.25, 0.30, coarse.z + 0.5 * fine.z));
    vec3 albedo = mix(green, heath, smoothstep(0.22, 0.58, high));
    albedo = mix(albedo, scree, smoothstep(0.55, 0.80, high));
    albedo = mix(albedo, rock, smoothstep(0.13, 0.30, steep));
    albedo = mix(albedo, snow, smoothstep(0.80, 0.92, high) * (1.0 - smoothstep(0.22, 0.42, steep)));
    albedo *= 1.0 + 1.1 * fine.z + 0.35 * coarse.z;

    // small bumps that no sample holds
    normal = normalize(normal - vec3(0.8 * fine.xy, 0.0));
    colour_out = vec4(behind_air(display(lit(albedo, normal)), p_eye, distance), 1.0);
}
