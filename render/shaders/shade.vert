// SPDX-License-Identifier: MIT
// A full-screen triangle.

out vec3 ray;  // component along forward is 1

void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    ray = frame.forward.xyz + corner.x * frame.right.xyz + corner.y * frame.up.xyz;
    gl_Position = vec4(corner, 0.0, 1.0);
}
