// SPDX-License-Identifier: MIT
// Blocks of two by two pixels, which shade.frag shades as one fragment. Their colours are in the layers of an array
// texture, one for each pixel of a block.

// Classes of blocks, as depths of a buffer: the depth test selects the blocks that a pass shades. A software rasteriser
// executes both sides of a branch, but omits fragments that fail the test.
#define SKY_BLOCKS 0
#define NEAR_BLOCKS 1   // ground whose samples are larger than blocks
#define FAR_BLOCKS 2    // other ground
#define MIXED_BLOCKS 3  // several surfaces or an object
float depth_of_class(int blocks) { return 0.25 * float(blocks); }
// Whether blocks of a depth have edges, or materials smaller than a few pixels.
bool has_edges(float depth) { return depth > 0.375; }

ivec2 pixel_of(ivec2 block, int index) { return 2 * block + ivec2(index & 1, index >> 1); }
// Side of the block's centre on which a pixel is, -1 or 1.
vec2 side_of(int index) { return vec2((index & 1) == 0 ? -1.0 : 1.0, index < 2 ? -1.0 : 1.0); }
// x, y: block of a pixel, z: its layer
ivec3 place_of(ivec2 pixel) { return ivec3(pixel >> 1, (pixel.x & 1) + 2 * (pixel.y & 1)); }
