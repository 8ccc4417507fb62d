// SPDX-License-Identifier: MIT
uniform vec3 colour;  // as displayed in full light

in vec3 p_eye;
in vec3 surface_normal;

layout(location = 0) out vec4 colour_out;

void main() {
    vec3 albedo = pow(colour, vec3(2.2));
    vec3 normal = normalize(surface_normal);
    vec3 light = lit_at(albedo, normal, p_eye, normal);
    colour_out = vec4(shown_at(light, p_eye), 1.0);
}
