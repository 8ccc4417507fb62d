// SPDX-License-Identifier: MIT
// One sample of a chunk. All arithmetic on its place is in integers up to one rounding, and depends
// on the sample's own integers and the eye only: chunks of all levels give it the same position.

layout(location = 0) in int height;  // quanta

uniform ivec4 corner;  // lattice index minus the eye's: x high, x low, y high, y low part
uniform ivec2 stride;  // finest spacings between samples: high, low part
uniform vec3 tile;     // xy: the corner's place in its root square, z: between samples; metres

out vec3 p_eye;
out vec2 cell;       // place in the chunk, in samples
out vec2 tile_m;     // place in the root square, metres
out float height_m;  // world z

invariant gl_Position;

const int kSamples = 129;
const int kIndexBits = 20;
const int kHeightBits = 16;

// Metres from the eye's lattice point.
float place(int high, int low, int index) {
    low += index * stride.y;
    int carry = (low + (1 << (kIndexBits - 1))) >> kIndexBits;
    low -= carry << kIndexBits;
    high += index * stride.x + carry;
    precise float metres =
        float(high) * (frame.grid.x * float(1 << kIndexBits)) + float(low) * frame.grid.x;
    return metres;
}

float rise() {
    int low = (height & ((1 << kHeightBits) - 1)) - frame.eye_height.y;
    int carry = (low + (1 << (kHeightBits - 1))) >> kHeightBits;
    low -= carry << kHeightBits;
    int high = (height >> kHeightBits) - frame.eye_height.x + carry;
    precise float metres =
        float(high) * (frame.grid.y * float(1 << kHeightBits)) + float(low) * frame.grid.y;
    return metres;
}

void main() {
    int row = gl_VertexID / kSamples;
    int column = gl_VertexID - row * kSamples;
    precise vec3 place_eye = vec3(place(corner.x, corner.y, column), place(corner.z, corner.w, row),
                                  rise()) - frame.remainder.xyz;
    p_eye = place_eye;
    cell = vec2(column, row);
    tile_m = tile.xy + cell * tile.z;
    height_m = float(height) * frame.grid.y;
    gl_Position = frame.clip_from_eye * vec4(place_eye, 1.0);
}
