// SPDX-License-Identifier: MIT
// Material of a textured surface. Macros say what the material has: see MaterialFeature in materials.h. The program
// defines SAMPLES.
#ifdef COLOUR_TEXTURE
layout(binding = 16) uniform sampler2D colour_texture;  // linear when read, opacity
#endif
#ifdef NORMAL_TEXTURE
layout(binding = 17) uniform sampler2D normal_texture;
#endif
#ifdef GLOSS_TEXTURE
layout(binding = 18) uniform sampler2D roughness_metal_texture;  // y: roughness, z: metal
#endif

uniform vec3 emission;
uniform vec4 finish;  // x: roughness, y: metal, z: scale of the normals, w: alpha cutoff

in vec2 texture_at;
in vec4 surface_colour;  // with display gamma, opacity

// Linear colour, and opacity.
vec4 albedo_here() {
    vec4 albedo = vec4(pow(surface_colour.rgb, vec3(2.2)), surface_colour.a);
#ifdef COLOUR_TEXTURE
    albedo *= texture(colour_texture, texture_at);
#endif
    return albedo;
}

// Opacity after the cut, 0 to 1. With several samples the edge is one pixel wide, as an edge of triangles.
// alpha: before the cut, in uniform control flow
float opacity_of(float alpha) {
#ifndef CUT
    return 1.0;
#else
#if SAMPLES > 1
    return clamp((alpha - finish.w) / max(fwidth(alpha), 1e-4) + 0.5, 0.0, 1.0);
#else
    return alpha >= finish.w ? 1.0 : 0.0;
#endif
#endif
}

// The normal with the texture's bumps. The tangents are those of the texture coordinates, from the changes to the
// neighbouring pixels: M. Mikkelsen, Bump Mapping Unparametrized Surfaces on the GPU, 2010; C. Schueler, Normal Mapping
// without Precomputed Tangents, ShaderX 5, 2006.
// normal: unit, towards the viewer. p: of the surface, in the frame of the normal
vec3 bumped(vec3 normal, vec3 p) {
#ifndef NORMAL_TEXTURE
    return normal;
#else
    vec3 bump = 2.0 * texture(normal_texture, texture_at).xyz - 1.0;
    bump.xy *= finish.z;
    // p changes along the surface by the cross products per unit of the picture's axes, up to a common factor
    vec3 across = cross(dFdy(p), normal), upward = cross(normal, dFdx(p));
    vec2 at_x = dFdx(texture_at), at_y = dFdy(texture_at);
    vec3 right = across * at_x.x + upward * at_y.x, up = across * at_x.y + upward * at_y.y;
    float longest = max(dot(right, right), dot(up, up));
    if (longest > 0.0) {
        float scale = inversesqrt(longest);
        bump = bump.x * scale * right + bump.y * scale * up + bump.z * normal;
    } else {
        bump = normal;
    }
    float size = length(bump);
    return size > 0.0 ? bump / size : normal;
#endif
}
