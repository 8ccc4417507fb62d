// SPDX-License-Identifier: MIT
in vec3 ray;

layout(location = 0) out vec4 colour_out;

void main() {
    vec3 direction = normalize(ray);
    vec3 colour = sky(direction);
    // the sun itself, a quarter of a degree
    float disc = smoothstep(0.99998, 0.999992, dot(direction, frame.sun.xyz));
    colour_out = vec4(mix(colour, vec3(1.0, 0.98, 0.92), disc), 1.0);
}
