// SPDX-License-Identifier: MIT
// Six vertices form one disc.
layout(std430, binding = 1) readonly buffer Particles {
    vec4 particles[];  // two per particle: see Particle
};

out vec3 p_eye;
out vec2 at;  // -1 to 1
flat out vec4 colour_of;
flat out float radius;

void main() {
    int particle = 2 * (gl_VertexID / 6);
    vec4 place = particles[particle];       // xyz: centre from the eye, metres, w: radius
    vec4 colour = particles[particle + 1];  // rgb with display gamma, opacity at the centre
    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1),
                                   vec2(-1, 1));
    at = corners[gl_VertexID % 6];
    // perpendicular to the direction from the eye: discs near the picture's edge are not stretched
    vec3 towards = -normalize(place.xyz);
    vec3 right = normalize(cross(normalize(frame.up.xyz), towards));
    vec3 up = cross(towards, right);
    p_eye = place.xyz + place.w * (right * at.x + up * at.y);
    colour_of = colour;
    radius = place.w;
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
