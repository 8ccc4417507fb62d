// SPDX-License-Identifier: MIT
in vec3 surface_normal;
in vec3 surface_colour;
in float depth;

layout(location = 0) out vec4 colour_out;  // square root of linear colour, opacity
layout(location = 1) out vec4 shape_out;   // xyz: normal, w: depth; 0 to 1

void main() {
    vec3 normal = normalize(surface_normal);
    if (!gl_FrontFacing) normal = -normal;
    colour_out = vec4(pow(surface_colour, vec3(1.1)), 1.0);
    shape_out = vec4(0.5 + 0.5 * normal, 0.5 + 0.5 * depth);
}
