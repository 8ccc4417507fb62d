// SPDX-License-Identifier: MIT
// Deferred shading of ground and sky under the overlay, once per pixel: the position of the ground is reconstructed
// from depth. Hence small triangles cost no more than large ones, and lighting depends neither on the triangles nor on
// the chunks that were drawn.
//
// SAMPLES (of the depth and the overlay), OVERLAY (whether there is one) and SMOOTHED (whether smooth.frag follows) are
// defined by the program. With materials, a fragment has PIXELS pixels: 1, or 4, a block of two by two pixels that
// share all that varies slowly. BLOCKS is then the class of blocks that the program shades: see block.glsl.

#if SAMPLES > 1
layout(binding = 2) uniform sampler2DMS depths;
layout(binding = 3) uniform sampler2DMS overlays;  // rgb: times alpha
#else
layout(binding = 2) uniform sampler2D depths;
layout(binding = 3) uniform sampler2D overlays;
#endif
layout(binding = 0) uniform sampler2DArray slopes;  // see light_levels.h
layout(binding = 1) uniform sampler2D noise;        // see ground_shade.cpp
layout(binding = 4) uniform sampler2DArray nodes;   // x: level, y: share of the chunk's own level; see light_levels.h

#ifdef MATERIALS
layout(binding = 13) uniform sampler2DArray bends;  // in the layout of slopes
#endif

layout(binding = 5) uniform isamplerBuffer table;  // xy: chunk relative to the eye's, z: its
                                                   // level (-1: free), w: layer of slopes and nodes

// see ground_shade.cpp
layout(std140, binding = 1) uniform Light {
    float root_spacing;
    int finest_level;
    int table_mask;
    int broad_level;  // whose layer 0 has the bends over about 128 m
    vec4 levels[25];  // xy: position of the eye in its chunk of the level, 0 to 1, z: 1 / side, 1/m
} light;

in vec3 ray;

const int kLastLayer = 7;
// Mipmap bias of the noise: the level of a pixel's longer side would blur it.
const float kSharper = -1.2;
const float kNoiseTexels = 256.0;
// The samples of a pixel are shaded as one if their depths differ by at most the ratio kOneSurface and are coplanar
// within kOnePlane times the depth.
const float kOneSurface = 1.06;
// Share by which the distances of two blocks on one surface differ.
const float kOneSlope = 0.2;
const float kOnePlane = 0.004;

// Place in the maps of a chunk.
vec3 place_in_map(vec2 cell, int layer, float map) {
    float row = float(256 - (256 >> layer) + layer);
    vec2 texel = cell / float(1 << layer) + vec2(0.5, row + 0.5);
    return vec3(texel / vec2(129.0, 263.0), map);
}
vec2 slope_at(vec2 cell, int layer, float map) {
    return textureLod(slopes, place_in_map(cell, layer, map), 0.0).xy;
}

// Normal of the ground at a baseline of one pixel, as far as samples exist. Depends only on position, distance and
// direction.
// lie: of the ground over fixed baselines, x: steepness over about 16 m, y: bend over about 128 m; 0 without materials
vec3 ground_normal(vec3 p_eye, float pixel_m, out vec2 lie) {
    float wanted = log2(light.root_spacing / pixel_m);
    int level = clamp(int(ceil(wanted)), 0, light.finest_level);
    int map = -1;
    vec2 place;
    for (; level >= 0; --level) {
        vec4 grid = light.levels[level];
        place = grid.xy + p_eye.xy * grid.z;
        map = find_entry(table, light.table_mask, ivec2(floor(place)), level);
        if (map >= 0) break;
    }
    level = max(level, 0);
    place -= floor(place);
    // light level here: see light_levels.h
    vec2 node = textureLod(nodes, vec3((place * 2.0 + 0.5) / 3.0, float(map)), 0.0).xy;
    float share = clamp(wanted - float(level - 1), 0.0, 1.0);
    float followed = level == 0 ? min(wanted, 0.0) : node.x - (1.0 - share) * node.y;
    float coarser = clamp(float(level) - followed, 0.0, float(kLastLayer));
    int layer = min(int(coarser), kLastLayer - 1);
    vec2 cell = place * 128.0;
    vec2 slope = mix(slope_at(cell, layer, float(map)), slope_at(cell, layer + 1, float(map)),
                     coarser - float(layer));
    if (map < 0) slope = vec2(0.0);
    lie = vec2(0.0);
#ifdef MATERIALS
    int broad = level - light.broad_level;
    vec2 wide = slope_at(cell, clamp(broad - 3, 0, kLastLayer), float(map));
    lie.x = 1.0 - sqrt(max(1.0 - dot(wide, wide), 0.0));
    lie.y = textureLod(bends, place_in_map(cell, clamp(broad, 0, kLastLayer), float(map)), 0.0).x;
    if (map < 0) lie = vec2(0.0);
#endif
    return vec3(slope, sqrt(max(1.0 - dot(slope, slope), 0.0)));
}

#ifdef WATER
// Distance used for pixels without ground, metres.
const float kNoGround = 1e8;
#endif

// Height above the origin, metres.
float height_of(vec3 p_eye) {
    float eye_m = (float(frame.eye_height.x) * 65536.0 + float(frame.eye_height.y)) * frame.grid.y;
    return eye_m + frame.remainder.z + p_eye.z;
}

#ifdef MATERIALS
// Light reflected by the ground at pixels of one surface around a point.
void ground(vec3 centre, vec3 p_eye[PIXELS], out vec3 light[PIXELS]) {
    GroundPoint at;
    at.p_eye = centre;
    float distance = length(centre);
    at.along = centre / distance;
    at.pixel_m = distance * frame.grid.w;
    float footprint = at.pixel_m * inversesqrt(max(abs(at.along.z), 0.10));
#if PIXELS > 1 && BLOCKS != MIXED_BLOCKS
    float nearness = 1.0 / distance;
    at.is_smooth = lessThan(abs(vec2(dFdx(nearness), dFdy(nearness))), vec2(kOneSlope * nearness));
#elif PIXELS > 1
    at.is_smooth = bvec2(false);
#endif
#if PIXELS > 1 && BLOCKS == NEAR_BLOCKS
    at.normal = ground_normal(centre, footprint, at.lie);
    // between the centres of blocks all that varies slowly is linear
    vec4 slow = vec4(at.normal.xy, at.lie);
    vec4 slow_x = at.is_smooth.x ? 0.25 * dFdx(slow) : vec4(0.0);
    vec4 slow_y = at.is_smooth.y ? 0.25 * dFdy(slow) : vec4(0.0);
    for (int i = 0; i < PIXELS; ++i) {
        vec4 there = slow + side_of(i).x * slow_x + side_of(i).y * slow_y;
        at.normals[i] = vec3(there.xy, sqrt(max(1.0 - dot(there.xy, there.xy), 0.0)));
        at.lies[i] = there.zw;
    }
#else
    at.normal = vec3(0.0);
    at.lie = vec2(0.0);
    for (int i = 0; i < PIXELS; ++i) {
        at.normals[i] = ground_normal(p_eye[i], footprint, at.lies[i]);
        at.normal += at.normals[i];
        at.lie += at.lies[i] / float(PIXELS);
    }
    at.normal = normalize(at.normal);
#endif
    at.height_m = height_of(centre);
#ifdef WATER
    at.above_water_m = centre.z - frame.near.y;
#else
    at.above_water_m = 1e9;
#endif
    GroundSurface surface = ground_surface(at, p_eye);
#ifdef WAVES
    extra_depth = sea_depth(centre, at.normal);
#endif
    vec3 sun = sun_light(centre);
#ifdef CASCADES
    float shares[PIXELS];
    sun_shares(sun_share(centre, at.normal), centre, p_eye, at.normal, shares);
#endif
    for (int i = 0; i < PIXELS; ++i) {
        vec3 albedo = surface.albedo[i], normal = surface.normal[i];
#ifdef IMAGERY
        vec4 draped = imagery_at(p_eye[i], footprint);
        vec3 draped_albedo = albedo_of(draped.rgb / max(draped.a, 1.0 / 255.0));
        // the materials' detail replaces that finer than the texels
        float detail = smoothstep(-1.0, 3.0, log2(imagery.texel / at.pixel_m));
        draped_albedo *= mix(1.0, surface.tone[i], 0.8 * detail);
        vec3 blended = mix(sqrt(albedo), sqrt(draped_albedo), draped.a);
        albedo = draped.a > 0.0 ? blended * blended : albedo;
#endif
        float towards_sun = max(dot(normal, frame.sun.xyz), 0.0);
#ifdef CASCADES
        towards_sun *= shares[i];
#endif
        vec3 arriving = sun * towards_sun + ambient_light(normal.z);
#ifdef POINT_LIGHTS
        arriving += point_light(p_eye[i], normal);
#endif
        light[i] = albedo * rough_factor(surface.roughness, normal, at.along) * arriving;
    }
}
#if PIXELS == 1
vec3 ground(vec3 p_eye) {
    vec3 pixel[1], light[1];
    pixel[0] = p_eye;
    ground(p_eye, pixel, light);
    return light[0];
}
#endif
#else
// Light reflected by the ground.
vec3 ground(vec3 p_eye) {
    float distance = length(p_eye);
    vec3 along = p_eye / distance;
    float pixel_m = distance * frame.grid.w;
    vec2 lie;
    vec3 normal = ground_normal(p_eye, pixel_m * inversesqrt(max(abs(along.z), 0.10)), lie);

    float longer_m = pixel_m / max(abs(dot(along, normal)), 0.10);
    float fine_lod = log2(longer_m * frame.tint.z * kNoiseTexels) + kSharper;
    // fades out before its period becomes visible
    vec2 fine_at = frame.noise_phase.xy + p_eye.xy * frame.tint.z;
    vec3 fine = (textureLod(noise, fine_at, fine_lod).xyz - 0.5) * exp2(-distance / 220.0);
    float coarse_lod = log2(longer_m * frame.tint.w * 5.0 * kNoiseTexels) + kSharper;
    // rotated, so that the two periods do not align
    vec2 turned = vec2(3.0 * p_eye.x + 4.0 * p_eye.y, 3.0 * p_eye.y - 4.0 * p_eye.x);
    vec2 coarse_at = frame.noise_phase.zw + turned * frame.tint.w;
    vec3 coarse = textureLod(noise, coarse_at, coarse_lod).xyz - 0.5;

    float high = (height_of(p_eye) - frame.tint.x) * frame.tint.y + 0.16 * coarse.z + 0.05 * fine.z;
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
#ifdef IMAGERY
    vec4 draped = imagery_at(p_eye, pixel_m * inversesqrt(max(abs(along.z), 0.10)));
    // blends square roots, so that the fade looks even
    vec3 blended = mix(sqrt(albedo), sqrt(albedo_of(draped.rgb / max(draped.a, 1.0 / 255.0))), draped.a);
    albedo = draped.a > 0.0 ? blended * blended : albedo;
    // noise replaces detail finer than the texels
    float detail = 1.0 - draped.a * (1.0 - smoothstep(0.0, 4.0, log2(imagery.texel / pixel_m)));
    albedo *= 1.0 + detail * (1.1 * fine.z + 0.35 * coarse.z);
#else
    albedo *= 1.0 + 1.1 * fine.z + 0.35 * coarse.z;
#endif

    // bumps finer than the samples
    vec3 bumped = normalize(normal - vec3(0.8 * fine.xy, 0.0));
#ifdef WAVES
    extra_depth = sea_depth(p_eye, normal);
#endif
    return lit_at(albedo, bumped, p_eye, normal);
}
#endif

#ifdef BLOCKS
layout(location = 0) out vec4 colours_out[PIXELS];

// Displayed colours of pixels around a point without ground, and of the water before it.
void shade_sky(vec3 centre, vec3 rays[PIXELS], inout vec3 shown[PIXELS],
               bool is_shown[PIXELS]) {
    vec3 light = sky_light(normalize(centre));
    for (int i = 0; i < PIXELS; ++i) {
        vec3 direction = normalize(rays[i]);
        vec3 colour = with_sun(light, direction);
#ifdef WATER
        float level = frame.near.y;
        vec3 clear = exp(-kAbsorption * min(max(level, 0.0) / max(direction.z, 1e-30), kNoGround));
        colour = mix(display(through_water(vec3(0.0), kNoGround, vec3(0.0))), colour, clear);
#ifdef WAVES
        extra_depth = 0.0;
#endif
        if (direction.z * kNoGround < level) colour = shown_at(vec3(0.0), direction * kNoGround);
#endif
        shown[i] = is_shown[i] ? colour : shown[i];
    }
}
void shade_ground(vec3 centre, vec3 p_eye[PIXELS], inout vec3 shown[PIXELS],
               bool is_shown[PIXELS]) {
    vec3 light[PIXELS];
    ground(centre, p_eye, light);
    AirBefore before = air_up_to(centre, length(centre));
    for (int i = 0; i < PIXELS; ++i) {
        vec3 colour = shown_at(light[i], p_eye[i], before);
        shown[i] = is_shown[i] ? colour : shown[i];
    }
}

void main() {
    ivec2 last = textureSize(depths, 0) - 1;
    vec2 across = 2.0 / vec2(last + 1);
    float depth[PIXELS];
    vec3 rays[PIXELS], shown[PIXELS];
    for (int i = 0; i < PIXELS; ++i) {
        ivec2 pixel = pixel_of(ivec2(gl_FragCoord.xy), i);
        depth[i] = texelFetch(depths, min(pixel, last), 0).x;
        vec2 place = (vec2(pixel) + 0.5) * across - 1.0;
        rays[i] = frame.forward.xyz + place.x * frame.right.xyz + place.y * frame.up.xyz;
        shown[i] = vec3(0.0);
    }
    vec3 centre = 0.5 * (rays[0] + rays[PIXELS - 1]);
    bool is_member[PIXELS];
#if BLOCKS == SKY_BLOCKS
    for (int i = 0; i < PIXELS; ++i) is_member[i] = true;
    shade_sky(centre, rays, shown, is_member);
#elif BLOCKS == NEAR_BLOCKS || BLOCKS == FAR_BLOCKS
    vec3 p_eye[PIXELS];
    float mean = 0.0;
    for (int i = 0; i < PIXELS; ++i) {
        is_member[i] = true;
        p_eye[i] = rays[i] * (frame.near.x / depth[i]);
        mean += 0.25 * depth[i];
    }
    shade_ground(centre * (frame.near.x / mean), p_eye, shown, is_member);
#else
    for (int i = 0; i < PIXELS; ++i) is_member[i] = depth[i] == 0.0;
    shade_sky(centre, rays, shown, is_member);
    // the nearest surface, and then the others as one
    bool is_left[PIXELS];
    for (int i = 0; i < PIXELS; ++i) is_left[i] = depth[i] > 0.0;
    bool is_first = true, is_any;
    do {
        float most = 0.0, sum = 0.0, count = 0.0;
        for (int i = 0; i < PIXELS; ++i) most = max(most, is_left[i] ? depth[i] : 0.0);
        float limit = is_first ? most / kOneSurface : 0.0;
        vec3 mean = vec3(0.0);
        for (int i = 0; i < PIXELS; ++i) {
            is_member[i] = is_left[i] && depth[i] >= limit;
            is_left[i] = is_left[i] && !is_member[i];
            sum += is_member[i] ? depth[i] : 0.0;
            mean += is_member[i] ? rays[i] : vec3(0.0);
            count += is_member[i] ? 1.0 : 0.0;
        }
        // the mean ray at the mean depth; the factors 1 / count cancel
        vec3 p_centre = count > 0.0 ? mean * (frame.near.x / sum) : centre;
        vec3 p_eye[PIXELS];
        for (int i = 0; i < PIXELS; ++i)
            p_eye[i] = is_member[i] ? rays[i] * (frame.near.x / depth[i]) : p_centre;
        shade_ground(p_centre, p_eye, shown, is_member);
        is_first = false;
        is_any = false;
        for (int i = 0; i < PIXELS; ++i) is_any = is_any || is_left[i];
    } while (is_any);
#endif
    for (int i = 0; i < PIXELS; ++i) {
#if OVERLAY
        vec4 over = texelFetch(overlays, min(pixel_of(ivec2(gl_FragCoord.xy), i), last), 0);
        shown[i] = over.rgb + (1.0 - over.a) * shown[i];
#endif
        colours_out[i] = vec4(shown[i], dot(shown[i], vec3(0.299, 0.587, 0.114)));
    }
}
#else
layout(location = 0) out vec4 colour_out;

#ifdef WATER
// Colour of ground, water or sky at a depth.
vec3 background(float depth) {
    float level = frame.near.y;
    vec3 p_eye = depth > 0.0 ? ray * (frame.near.x / depth) : normalize(ray) * kNoGround;
    vec3 light = vec3(0.0);
#ifdef WAVES
    extra_depth = 0.0;
#endif
    if (depth > 0.0 && !is_hidden(p_eye)) light = ground(p_eye);
    vec3 shown = shown_at(light, p_eye);
    if (depth == 0.0 && p_eye.z >= level) {
        vec3 clear = exp(-kAbsorption * min(max(level, 0.0) / max(ray.z, 1e-30) * length(ray), kNoGround));
        shown = mix(display(through_water(vec3(0.0), kNoGround, vec3(0.0))),
                    sky_with_sun(normalize(ray)), clear);
    }
    return shown;
}
#else
// Colour of ground or sky (depth 0) at a depth.
vec3 background(float depth) {
    vec3 p_eye = ray * (frame.near.x / depth);
    return depth > 0.0 ? shown_at(ground(p_eye), p_eye) : sky_with_sun(normalize(ray));
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float least = 1.0, most = 0.0;
    for (int i = 0; i < SAMPLES; ++i) {
        float depth = texelFetch(depths, pixel, i).x;
        least = min(least, depth);
        most = max(most, depth);
    }
    bool is_one = most <= kOneSurface * least || most == 0.0;
#if SAMPLES == 4
    // samples 0 and 3, and 1 and 2, are opposite; the depth of a plane is linear over the picture
    float bend = texelFetch(depths, pixel, 0).x + texelFetch(depths, pixel, 3).x -
                 texelFetch(depths, pixel, 1).x - texelFetch(depths, pixel, 2).x;
    is_one = is_one && abs(bend) <= kOnePlane * most;
#endif
    int count = is_one ? 1 : SAMPLES;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < count; ++i) {
        // each sample with its own depth: an average of two surfaces is on neither
        vec3 behind = background(texelFetch(depths, pixel, i).x);
#if OVERLAY
        vec4 over = texelFetch(overlays, pixel, i);
        for (int other = 1; is_one && other < SAMPLES; ++other) {
            over += texelFetch(overlays, pixel, other);
        }
        if (is_one) over /= float(SAMPLES);
        behind = over.rgb + (1.0 - over.a) * behind;
#endif
        sum += behind;
    }
    vec3 colour = sum / float(count);
#if SMOOTHED
    colour_out = vec4(colour, dot(colour, vec3(0.299, 0.587, 0.114)));  // luma for smooth.frag
#else
    colour_out = vec4(colour, 1.0);
#endif
}
#endif
