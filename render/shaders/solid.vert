// SPDX-License-Identifier: MIT
// A vertex of a solid surface: a sample of the finest level, and an offset from it. Without an offset it has the bits of
// terrain.vert, so that both surfaces meet.
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

const int kIndexBits = 20;
const int kHeightBits = 16;

// Metres from the eye's lattice point.
float place_along(int high, int low, int index) {
    low += index * stride.y;
    int carry = (low + (1 << (kIndexBits - 1))) >> kIndexBits;
    low -= carry << kIndexBits;
    high += index * stride.x + carry;
    precise float metres =
        float(high) * (frame.grid.x * float(1 << kIndexBits)) + float(low) * frame.grid.x;
    return metres;
}

float rise(int height) {
    int low = (height & ((1 << kHeightBits) - 1)) - frame.eye_height.y;
    int carry = (low + (1 << (kHeightBits - 1))) >> kHeightBits;
    low -= carry << kHeightBits;
    int high = (height >> kHeightBits) - frame.eye_height.x + carry;
    precise float metres =
        float(high) * (frame.grid.y * float(1 << kHeightBits)) + float(low) * frame.grid.y;
    return metres;
}

void main() {
    precise vec3 place_eye =
        vec3(place_along(corner.x, corner.y, place.x), place_along(corner.z, corner.w, place.y),
             rise(place.z)) - frame.remainder.xyz;
    place_eye += offset;
    p_eye = place_eye;
    surface_normal = normal;
    depth_below = depth;
    gl_Position = frame.clip_from_eye * vec4(place_eye, 1.0);
}
