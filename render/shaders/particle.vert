// SPDX-License-Identifier: MIT
// Six vertices form one disc, or with IMAGE one image.
layout(std430, binding = 1) readonly buffer Particles {
    vec2 particles[];  // five per particle: see Particle
};

out vec3 p_eye;
out vec2 at;  // from the centre, in units of the radius
#ifdef IMAGE
out vec2 image_at;  // 0 to 1
#endif
flat out vec4 colour_of;
flat out float radius;

void main() {
    int particle = 5 * (gl_VertexID / 6);
    // xyz: centre from the eye, metres, w: radius
    vec4 place = vec4(particles[particle], particles[particle + 1]);
    // rgb with display gamma, opacity at the centre
    vec4 colour = vec4(particles[particle + 2], particles[particle + 3]);
    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1),
                                   vec2(-1, 1));
    at = corners[gl_VertexID % 6];
#ifdef IMAGE
    image_at = 0.5 + 0.5 * at;
    float turn = particles[particle + 4].x;
    at = mat2(cos(turn), sin(turn), -sin(turn), cos(turn)) * at;
#endif
    // perpendicular to the direction from the eye: discs near the picture's edge are not stretched
    vec3 towards = -normalize(place.xyz);
    vec3 right = normalize(cross(normalize(frame.up.xyz), towards));
    vec3 up = cross(towards, right);
    p_eye = place.xyz + place.w * (right * at.x + up * at.y);
    colour_of = colour;
    radius = place.w;
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
