// SPDX-License-Identifier: MIT
in vec3 surface_normal;
#ifdef TEXTURED
in vec3 p_object;
#else
in vec3 surface_colour;
#endif
in float depth;

// An impostor is lit as a matt surface: a metal of roughness 1 is darker than such a surface of its colour by this
// share, averaged over the directions of sun and eye.
const float kLossOfMetal = 0.55;

layout(location = 0) out vec4 colour_out;  // square root of linear colour, opacity
layout(location = 1) out vec4 shape_out;   // xyz: normal, w: depth; 0 to 1

void main() {
    vec3 normal = normalize(surface_normal);
    if (!gl_FrontFacing) normal = -normal;
#ifdef TEXTURED
    vec4 albedo = albedo_here();
    float opacity = opacity_of(albedo.a);
    normal = bumped(normal, p_object);
#ifdef GLOSS
    float metal = finish.y;
#ifdef GLOSS_TEXTURE
    metal *= texture(roughness_metal_texture, texture_at).z;
#endif
    albedo.rgb *= 1.0 - kLossOfMetal * metal;
#endif
    if (opacity < 0.5) discard;
    colour_out = vec4(sqrt(albedo.rgb), 1.0);
#else
    colour_out = vec4(pow(surface_colour, vec3(1.1)), 1.0);
#endif
    shape_out = vec4(0.5 + 0.5 * normal, 0.5 + 0.5 * depth);
}
