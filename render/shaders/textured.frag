// SPDX-License-Identifier: MIT
// An instance with textures: see instance.frag.
in vec3 p_eye;
in vec3 surface_normal;
flat in float coverage;

layout(location = 0) out vec4 colour_out;

// Reflectance of glass, water and paint seen from the front.
const float kDielectric = 0.04;

#ifdef GLOSS
// Light that the surface reflects as a mirror of some roughness: the sun by the distribution of Trowbridge and Reitz
// (B. Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007) with the masking of
// C. Schlick, An Inexpensive BRDF Model for Physically-based Rendering, CGF 13(3), 1994; the sky by a fit of the same
// integral over all directions (B. Karis, Physically Based Shading on Mobile, 2014).
// sun: share of sunlight that arrives
vec3 reflected(vec3 front, float roughness, vec3 normal, float sun) {
    vec3 towards = normalize(-p_eye);
    vec3 middle = normalize(towards + frame.sun.xyz);
    float to_eye = max(dot(normal, towards), 1e-3), to_sun = max(dot(normal, frame.sun.xyz), 0.0);
    float a = max(roughness * roughness, 2e-3);
    float along = max(dot(normal, middle), 0.0);
    float spread = along * along * (a * a - 1.0) + 1.0;
    float k = 0.5 * a;
    float visible = 0.25 / ((to_eye * (1.0 - k) + k) * (to_sun * (1.0 - k) + k));
    float grazing = pow(1.0 - max(dot(towards, middle), 0.0), 5.0);
    // sun_light() is light over pi, which cancels the pi of the distribution
    vec3 of_sun = (front + (1.0 - front) * grazing) * (a * a * visible / (spread * spread)) *
                  sun_light(p_eye) * (to_sun * sun);

    vec4 fit = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float b = min(fit.x * fit.x, exp2(-9.28 * to_eye)) * fit.x + fit.y;
    vec3 mirrored = reflect(-towards, normal);
    vec3 of_sky = (front * (-1.04 * b + fit.z) + (1.04 * b + fit.w)) *
                  ambient_light(mirrored.z);
    return of_sun + of_sky;
}
#endif

void main() {
    vec3 smooth_normal = normalize(surface_normal);
    if (!gl_FrontFacing) smooth_normal = -smooth_normal;
    vec4 albedo = albedo_here();
    float opacity = opacity_of(albedo.a);
    vec3 normal = bumped(smooth_normal, p_eye);
#ifdef GLOSS
    vec2 rough_metal = finish.xy;
#ifdef GLOSS_TEXTURE
    rough_metal *= texture(roughness_metal_texture, texture_at).yz;
#endif
#endif
    keep_samples(covered_samples(coverage, opacity));
#ifdef GLOSS
    float sun = 1.0;
#ifdef CASCADES
    sun = sun_share(p_eye, smooth_normal);
#endif
    vec3 front = mix(vec3(kDielectric), albedo.rgb, rough_metal.y);
    vec3 light = lit_from(albedo.rgb * (1.0 - rough_metal.y), sun * dot(normal, frame.sun.xyz),
                          normal.z, p_eye) +
                 reflected(front, rough_metal.x, normal, sun);
#ifdef POINT_LIGHTS
    light += albedo.rgb * (1.0 - rough_metal.y) * point_light(p_eye, normal);
#endif
#else
    vec3 light = lit_at(albedo.rgb, normal, p_eye, smooth_normal);
#endif
#ifdef EMISSION
    light += emission;
#endif
    colour_out = vec4(shown_at(light, p_eye), 1.0);
}
