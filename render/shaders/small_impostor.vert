// SPDX-License-Identifier: MIT
// A billboard of few pixels: shows only the nearest view, as a flat picture that faces the eye. See impostor.vert.
// Values that are constant over the billboard, such as haze, are computed here.
layout(std430, binding = 1) readonly buffer Instances {
    vec4 instances[];  // three per instance: see ObjectInstance
};

uniform int first_instance;
uniform vec3 centre;    // of the object's bounds, its frame, metres
uniform vec2 half_box;  // of the bounds: largest distance from the axis, half the height, metres
uniform ivec2 views;    // around the axis, from horizontal to above
uniform float texels;   // along the side of a view

out vec2 at;               // in the view, 0 to 1
flat out vec3 layer;       // x: of the view, y: of the mipmaps, z: coverage
flat out vec3 tint;        // of the view's colours
flat out vec3 sun_object;  // unit, in the object's frame
flat out vec3 up_object;
#ifdef POINT_LIGHTS
flat out vec4 rotation_of;
flat out vec3 middle_eye;  // of the object's bounds
#endif
#ifdef CASCADES
flat out float sun_part;   // of the whole billboard
#endif
#ifdef WATER
out vec3 place_eye;
#endif
#ifdef ATMOSPHERE
flat out vec3 place_of;    // of the object's origin from the eye, metres
flat out vec3 own_light;   // share of the object's light behind the air
flat out vec3 air_before;  // light of the air
#else
flat out vec4 haze;        // rgb, and the share of the object's own colour
#endif

const float kTurn = 6.283185307179586;
const float kSharper = 0.5;

void main() {
    int instance = 3 * (first_instance + gl_VertexID / 6);
    vec4 place = instances[instance];
    vec4 rotation = instances[instance + 1];
    vec4 share = instances[instance + 2];
    vec4 back = vec4(-rotation.xyz, rotation.w);
    vec3 eye_object = rotated(back, -place.xyz) / place.w;
    float distance = length(eye_object - centre);
    vec3 towards = (eye_object - centre) / distance;
    int around = int(round(atan(towards.y, towards.x) / kTurn * float(views.x)));
    around = (around + views.x) % views.x;
    int above = int(round(clamp(asin(clamp(towards.z, -1.0, 1.0)) * 4.0 / kTurn, 0.0, 1.0) *
                          float(views.y - 1)));

    float level = length(towards.xy);
    vec3 right = level > 1e-4 ? vec3(-towards.y, towards.x, 0.0) / level : vec3(0.0, 1.0, 0.0);
    vec3 up = views.y > 1 ? cross(towards, right) : vec3(0.0, 0.0, 1.0);
    // elevation at which the view was rendered
    float elevation = views.y > 1 ? float(above) * 0.25 * kTurn / float(views.y - 1) : 0.0;
    vec2 size = vec2(half_box.x, half_box.y * cos(elevation) + half_box.x * sin(elevation));
    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1),
                                   vec2(-1, 1));
    vec2 corner = corners[gl_VertexID % 6];
    at = 0.5 + 0.5 * corner;
    vec3 p_object = centre + right * (corner.x * size.x) + up * (corner.y * size.y);
    vec3 p_eye = place.xyz + rotated(rotation, place.w * p_object);

#ifdef WATER
    place_eye = p_eye;
#endif
    float pixel = distance * frame.grid.w;
    layer = vec3(float(around + views.x * above),
                 max(log2(pixel * texels / (2.0 * sqrt(size.x * size.y))) - kSharper, 0.0), share.x);
    tint = pow(share.yzw, vec3(1.1));
    sun_object = rotated(back, frame.sun.xyz);
    up_object = rotated(back, vec3(0.0, 0.0, 1.0));
#ifdef POINT_LIGHTS
    rotation_of = rotation;
    middle_eye = place.xyz + rotated(rotation, place.w * centre);
#endif
#ifdef CASCADES
    // sampled at the object's centre, moved towards the sun by the object's radius to avoid self-shadowing
    vec3 middle = place.xyz + rotated(rotation, place.w * centre);
    sun_part = sun_share(middle + frame.sun.xyz * (place.w * length(half_box)), frame.sun.xyz);
#endif
#ifdef ATMOSPHERE
    place_of = place.xyz;
    own_light = air_share(place.xyz, length(place.xyz));
    air_before = air_light(place.xyz, length(place.xyz));
#else
    vec3 black = behind_air(vec3(0.0), place.xyz, length(place.xyz));
    float own = behind_air(vec3(1.0), place.xyz, length(place.xyz)).g - black.g;
    haze = vec4(black, own);
#endif
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
