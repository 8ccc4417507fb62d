// SPDX-License-Identifier: MIT
layout(binding = 0) uniform sampler2DArray colours;  // see impostor.frag
layout(binding = 1) uniform sampler2DArray shapes;

in vec2 at;
flat in vec3 layer;
flat in vec3 tint;
flat in vec3 sun_object;
flat in vec3 up_object;
#ifdef POINT_LIGHTS
flat in vec4 rotation_of;
flat in vec3 middle_eye;
#endif
#ifdef CASCADES
flat in float sun_part;
#endif
#ifdef WATER
in vec3 place_eye;
#endif
#ifdef ATMOSPHERE
flat in vec3 place_of, own_light, air_before;
#else
flat in vec4 haze;
#endif

layout(location = 0) out vec4 colour_out;

void main() {
    vec4 colour = textureLod(colours, vec3(at, layer.x), layer.y);
    keep_samples(covered_samples(layer.z, colour.a));
    float shown = 1.0 / max(colour.a, 1.0 / 64.0);
    vec3 normal =
        normalize(2.0 * shown * textureLod(shapes, vec3(at, layer.x), layer.y).xyz - 1.0);
    vec3 root = shown * colour.rgb * tint;
    float towards_sun = dot(normal, sun_object);
#ifdef CASCADES
    towards_sun *= sun_part;
#endif
#ifdef ATMOSPHERE
    vec3 light = lit_from(root * root, towards_sun, dot(normal, up_object), place_of);
#else
    vec3 light = lit_from(root * root, towards_sun, dot(normal, up_object), vec3(0.0));
#endif
#ifdef POINT_LIGHTS
    light += root * root * point_light(middle_eye, rotated(rotation_of, normal));
#endif
#ifdef WATER
    colour_out = vec4(shown_at(light, place_eye), 1.0);
#elif defined(ATMOSPHERE)
    colour_out = vec4(display(own_light * light + air_before), 1.0);
#else
    colour_out = vec4(haze.rgb + haze.a * display(light), 1.0);
#endif
}
