// SPDX-License-Identifier: MIT
// A ball of smoke: its opacity falls off towards its edge and towards the intersection with surfaces behind it (T.
// Lorach, Soft Particles, NVIDIA 2007). With IMAGE its colour and opacity are those of a texture, lit as the ball.
#if SAMPLES > 1
layout(binding = 2) uniform sampler2DMS depths;
#else
layout(binding = 2) uniform sampler2D depths;  // last argument of texelFetch: level 0
#endif

in vec3 p_eye;
in vec2 at;
#ifdef IMAGE
layout(binding = 16) uniform sampler2D image;  // linear when read, opacity
in vec2 image_at;
#endif
flat in vec4 colour_of;
flat in float radius;

layout(location = 0) out vec4 colour_out;

void main() {
    float squared = dot(at, at);
#ifdef IMAGE
    vec4 texel = texture(image, image_at);
    float bulge = sqrt(max(1.0 - squared, 0.0));
#else
    if (squared >= 1.0) discard;
    float bulge = sqrt(1.0 - squared);
#endif
    float distance = dot(p_eye, frame.forward.xyz);
    float nearness = clamp((distance - frame.near.x) / radius, 0.0, 1.0);
    // mean over the samples, so that edges of occluders are smooth
    float softness = 0.0;
    for (int i = 0; i < SAMPLES; ++i) {
        float depth = texelFetch(depths, ivec2(gl_FragCoord.xy), i).x;
        // depth along the view direction of the surface behind; far away if there is none
        float behind = depth > 0.0 ? frame.near.x / depth : 1e30;
        softness += clamp((behind - distance) / radius + 0.5 * bulge, 0.0, 1.0) / float(SAMPLES);
    }
#ifdef IMAGE
    float opacity = colour_of.a * texel.a * nearness * softness;
#else
    float opacity = colour_of.a * bulge * bulge * nearness * softness;
#endif
    vec3 towards = -normalize(p_eye);
    vec3 normal = normalize(towards * bulge + frame.up.xyz / length(frame.up.xyz) * at.y +
                            frame.right.xyz / length(frame.right.xyz) * at.x);
    // light passes through smoke: half of it does not depend on direction
    vec3 albedo = pow(colour_of.rgb, vec3(2.2));
#ifdef IMAGE
    albedo *= texel.rgb;
#endif
    vec3 light = 0.5 * (lit(albedo, normal, p_eye) + lit(albedo, frame.sun.xyz, p_eye));
#ifdef POINT_LIGHTS
    light += 0.5 * albedo * point_light(p_eye, normal);
#endif
    vec3 shown = shown_at(light, p_eye);
    colour_out = vec4(shown * opacity, opacity);
}
