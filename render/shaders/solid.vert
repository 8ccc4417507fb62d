// SPDX-License-Identifier: MIT
// A vertex of a solid surface: a sample of the finest level, and an offset from it. Without an offset its position
// equals that of terrain.vert bit for bit, so that both surfaces meet.
layout(location = 0) in ivec3 place;   // column, row, height in quanta
layout(location = 1) in vec3 offset;   // metres
layout(location = 2) in vec3 normal;
layout(location = 3) in float depth;   // below the heightfield, metres

uniform ivec4 corner;  // lattice index minus the eye's: x high, low, y high, low
uniform ivec2 stride;  // finest spacings between samples: high, low part

out vec3 p_eye;
out vec3 surface_normal;
out float depth_below;

invariant gl_Position;

void main() {
    precise vec3 place_eye =
        vec3(lattice_place(corner.x, corner.y, place.x, stride),
             lattice_place(corner.z, corner.w, place.y, stride), lattice_rise(place.z)) -
        frame.remainder.xyz;
    place_eye += offset;
    p_eye = place_eye;
    surface_normal = normal;
    depth_below = depth;
    gl_Position = frame.clip_from_eye * vec4(place_eye, 1.0);
}
