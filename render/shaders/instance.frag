// SPDX-License-Identifier: MIT
in vec3 p_eye;
in vec3 surface_normal;
in vec3 surface_colour;
flat in float coverage;

layout(location = 0) out vec4 colour_out;

void main() {
    keep_samples(covered_samples(coverage, 1.0));
    vec3 normal = normalize(surface_normal);
    if (!gl_FrontFacing) normal = -normal;
    vec3 light = lit_at(pow(surface_colour, vec3(2.2)), normal, p_eye, normal);
    colour_out = vec4(shown_at(light, p_eye), 1.0);
}
