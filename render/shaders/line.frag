// SPDX-License-Identifier: MIT
// The wireframe; fades where triangles become as small as pixels.

in vec3 p_eye;

layout(location = 0) out vec4 colour_out;

void main() {
    float distance = length(p_eye);
    // premultiplied: composited over the ground by shade.frag
    colour_out = vec4(0.02, 0.03, 0.05, 1.0) * (0.55 * exp2(-frame.grid.z * distance));
}
