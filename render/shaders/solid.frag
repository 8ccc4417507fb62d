// SPDX-License-Identifier: MIT
// Walls of volumes. Daylight fades with the depth below the heightfield, where a lamp at the eye takes over.
layout(binding = 1) uniform sampler2D noise;  // see ground_shade.cpp

in vec3 p_eye;
in vec3 surface_normal;
in float depth_below;

layout(location = 0) out vec4 colour_out;

// log2(3): 2^-x leaves a third at this x.
const float kToThird = 1.585;
const float kSunDepth = 5.0;   // depth at which a third of the sunlight is left, metres
const float kSkyDepth = 11.0;  // the same for the sky, metres
const float kLampRange = 20.0; // distance at which the lamp has a quarter of its light, metres

void main() {
    float distance = length(p_eye);
    vec3 along = p_eye / distance;
    // a cap's inner vertices have no walls around them
    vec3 normal = dot(surface_normal, surface_normal) > 0.0 ? normalize(surface_normal) : -along;

    vec3 smooth_normal = normal;

    // the noise along the three axes, blended by the normal
    vec2 root = frame.noise_phase.xy + p_eye.xy * frame.tint.z;
    float up = frame.tint.z * (p_eye.z + frame.remainder.z +
                               (float(frame.eye_height.x) * 65536.0 + float(frame.eye_height.y)) *
                               frame.grid.y);
    vec3 weight = abs(normal) / (abs(normal.x) + abs(normal.y) + abs(normal.z));
    vec3 rough = vec3(0.0);
    for (float scale = 1.0; scale < 10.0; scale *= 4.0) {
        rough += weight.z * texture(noise, scale * root).xyz +
                 weight.x * texture(noise, scale * vec2(root.y, up)).xyz +
                 weight.y * texture(noise, scale * vec2(root.x, up)).xyz - 0.5;
    }
    rough *= exp2(-distance / 150.0);

    vec3 albedo = mix(vec3(0.215, 0.190, 0.160), vec3(0.150, 0.138, 0.128),
                      smoothstep(0.5, 5.0, depth_below));
    albedo *= 1.0 + 0.9 * rough.z;
    normal = normalize(normal + 0.35 * vec3(rough.xy, rough.y - rough.x));

    float below = max(depth_below, 0.0);
    float sun = exp2(-kToThird * below / kSunDepth), sky = exp2(-kToThird * below / kSkyDepth);
#ifdef CASCADES
    sun *= sun_share(p_eye, smooth_normal);
#endif
    vec3 light = albedo * (sun_light(p_eye) * sun * max(dot(normal, frame.sun.xyz), 0.0) +
                           sky * ambient_light(normal.z));
    float range = 1.0 + distance / kLampRange;
    float lamp = (1.0 - sky) * (0.25 + 0.75 * max(dot(normal, -along), 0.0)) *
                 (0.35 + 0.65 * smoothstep(0.6, 0.95, dot(along, frame.forward.xyz)));
    light += albedo * kLampLight * lamp / (range * range);
#ifdef POINT_LIGHTS
    light += albedo * point_light(p_eye, normal);
#endif
    // no haze of the open air inside
    colour_out = vec4(mix(display(light), shown_at(light, p_eye), sky), 1.0);
}
