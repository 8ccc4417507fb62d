// Buffers and helpers of the compute shaders that triangulate: see gpu_triangulator.cpp. Every float that decides what is
// drawn is computed by the operations of terrain/lod/key_kernels.h, in their order, and `precise`.
#version 450 core

layout(std140, binding = 0) uniform Frame {
    dvec4 eye_spacing;     // the eye, world; spacing of the finest level
    dvec4 origin_quantum;  // the lattice's origin; quantum; near distance
    dvec4 normals[4];      // inward normals of the view's side planes
    dvec4 eye_lattice;     // the eye's lattice point: see EyeFrame
    dvec4 distances;       // least distance to the true surface, metres; 0; ratio and full of the morph: see Morph
    vec4 planes[4];        // the normals
    vec4 scalars;          // square of the near distance, near distance, floor, full of the morph
    vec4 guess;            // low end of the first window of the selection
    uvec4 counts;          // resident chunks, roots, budget, demands
    uvec4 bases;           // in work[]: list of areas, slots of areas, masks, counts
    uvec4 more_bases;      // in keys[]: sides, coarse; in offsets[]: coarse; in keys[]: axes
    uvec4 options;         // levels, whether vertices morph, finest level, groups of pins
    uvec4 last_bases;      // in work[]: squares, candidates, lists of areas; number of candidates that fit
    uvec4 capacity;        // areas that fit; in work[]: places; in vertices[]: slots, behind the roots' coarse bounds;
                           // in work[]: flags of volumes, see drawn_pin()
    uvec4 level_first[8];  // first chunk of each level, and their number
    vec4 reaches[33];      // by log2 of the spacing: half width and height of a centre's, of a midpoint's
};

layout(std430, binding = 0) readonly buffer Chunks { uint chunks[]; };
layout(std430, binding = 1) readonly buffer Vertices { uint vertices[]; };
layout(std430, binding = 2) readonly buffer Heights { int heights[]; };
layout(std430, binding = 3) coherent buffer State { uint state[]; };
layout(std430, binding = 4) coherent buffer Work { uint work[]; };
layout(std430, binding = 5) coherent buffer Keys { float keys[]; };
layout(std430, binding = 6) coherent buffer Offsets { float offsets[]; };
layout(std430, binding = 7) buffer Indices { uint indices[]; };

const uint kTableWords = 12u;  // of a chunk in chunks[]
const uint kFrameWords = 4u;
const uint kSlotWords = 26128u;  // of a chunk in vertices[]
const uint kSamples = 16641u;    // 129 x 129
const uint kHeightWords = 33025u;  // of a chunk in heights[]: its samples, and the bounds of its cells
const uint kAreaWords = 400u;
const uint kBoundsWord = 25600u, kReachesWord = 25664u, kEastWord = 25728u, kNorthWord = 25824u, kHeaderWord = 25920u;
const uint kAreaHeightsWord = 25936u, kCellBoundsWord = 26064u;  // lowest and highest samples, largest cell bounds of areas
const uint kAreaKeys = 192u;
const uint kAreaOffsets = 289u;  // 17 x 17
const uint kCoarse = 4225u;      // 65 x 65
const uint kCoarseSide = 65u;
const uint kNone = 0xffffffffu;
const uint kWest = 0u, kEast = 1u, kSouth = 2u, kNorth = 3u;
const uint kCentre = 0u, kAlongX = 1u, kAlongY = 2u;

// Words of state[]
const uint kAreaTotal = 0u, kThreshold = 1u, kLow = 2u, kHigh = 3u, kShift = 4u, kTriangles = 5u, kBelow = 6u;
const uint kResiduals = 160u;  // bits of floats: see kAbsentError and others of lod_error.glsl
const uint kDraw = 8u;         // DrawElementsIndirectCommand
const uint kLevelGroups = 20u;  // three words for each level
const uint kAllGroups = 96u;    // three words
const uint kLevelAreas = 100u;  // first area of each level, and their number
const uint kSearchGroups = 128u, kPickGroups = 144u;  // three words for each step of the selection
const uint kCandidates = 168u;    // number of candidates of lod_error.comp
const uint kErrorGroups = 169u;   // three words
const uint kHeldGroups = 172u, kCellGroups = 175u;  // three words: areas with held vertices, with cells of lod_cells.glsl
const uint kSlope = 178u;          // bits of the slope of morphs
const uint kAbove = 179u;          // of lod_above.comp: bit 0, a triangle is below or above the place; bit 1, one is above
const uint kBins = 184u;
const uint kBinCount = 2048u;
const uint kRootTriangles = kBins + kBinCount;  // first triangle of each root's coarse triangles; 4096 roots at most

const uint kSearchers = 256u;    // groups of a step of the selection
const uint kWindowShift = 8u;    // of the bins of the first window
const float kNever = uintBitsToFloat(0x7f800000u);
const float kAboveFloor = uintBitsToFloat(0x7f7fffffu);

uint table(uint chunk, uint word) { return chunks[chunk * kTableWords + word]; }
uint level_of(uint chunk) { return table(chunk, 0u) & 31u; }
bool is_root(uint chunk) { return chunk < counts.y; }
bool is_east_child(uint chunk) { return (table(chunk, 0u) >> 5 & 1u) != 0u; }
bool is_north_child(uint chunk) { return (table(chunk, 0u) >> 6 & 1u) != 0u; }
bool is_at_border(uint chunk, uint side) { return (table(chunk, 0u) >> (7u + side) & 1u) != 0u; }
bool is_cut_to_north_east(uint chunk) { return (table(chunk, 0u) >> 11 & 1u) != 0u; }
uint parent_of(uint chunk) { return table(chunk, 1u); }
uint neighbour_of(uint chunk, uint side) { return table(chunk, 2u + side); }
uint child_of(uint chunk, uint quadrant) { return table(chunk, 6u + quadrant); }

uint frame_word(uint chunk, uint word) { return chunks[counts.x * kTableWords + chunk * kFrameWords + word]; }
float least_key(uint chunk) { return uintBitsToFloat(frame_word(chunk, 0u)); }
float fade_factor(uint chunk) { return uintBitsToFloat(frame_word(chunk, 1u)); }
uint slot_of(uint chunk) { return frame_word(chunk, 2u); }
// Whether volumes may lower the chunk's keys: OpenChunk::is_pinned
bool is_pinned(uint chunk) { return (frame_word(chunk, 3u) & 1u) != 0u; }
// The group of the chunk's own pins; kNone if it has none
uint group_of(uint chunk) { return (frame_word(chunk, 3u) >> 1) - 1u; }
uint vertex_words(uint chunk) { return capacity.z + slot_of(chunk) * kSlotWords; }
double header(uint chunk, uint word) {
    const uint at = vertex_words(chunk) + kHeaderWord + word;
    return packDouble2x32(uvec2(vertices[at], vertices[at + 1u]));
}

// Pins of volumes, and the triangles that these replace: see SolidPins and ReplacedTriangles. Both begin with a rectangle of
// lattice points, edges included.
const uint kGroupWords = 12u, kPinWords = 26u;
uint first_group_word() { return counts.x * (kTableWords + kFrameWords) + 2u * counts.w; }
uint group_words(uint group) { return first_group_word() + group * kGroupWords; }
uint pin_words(uint pin) { return first_group_word() + options.w * kGroupWords + pin * kPinWords; }
uint first_pin(uint group) { return chunks[group_words(group) + 8u]; }
uint end_pin(uint group) { return chunks[group_words(group) + 9u]; }
float key_of_group(uint group) { return uintBitsToFloat(chunks[group_words(group) + 10u]); }
uint chunk_of_group(uint group) { return chunks[group_words(group) + 11u]; }
uint group_of_pin(uint pin) { return chunks[pin_words(pin) + 8u]; }
uint area_of_pin(uint pin) { return chunks[pin_words(pin) + 9u]; }
// Squares whose triangle 2 * side + half a volume replaces
uint replaced_squares(uint pin, uint triangle, uint half_index) { return chunks[pin_words(pin) + 10u + 2u * triangle + half_index]; }

// Flags of an area in the list: at the world's border; with a held vertex, see OpenChunk::held_areas
const uint kEndsSouth = 64u, kEndsWest = 128u, kHeld = 256u;
const float kNestMargin = 1.0 + 1.0 / 512.0;

// Work of a chunk: bits of its open areas, index of the first
uint open_mask(uint chunk, uint half_index) { return work[3u * chunk + half_index]; }
bool is_open(uint chunk) { return chunk != kNone && work[3u * chunk + 2u] != kNone; }
// A chunk's area in the list of open areas; kNone if it is not open
uint slot_of_area(uint chunk, uint area) { return work[bases.y + 64u * chunk + area]; }

struct Area {
    uint slot, chunk, area;
    bool ends_south, ends_west;  // at the world's border
};
Area area_at(uint slot) {
    const uint entry = work[bases.x + slot];
    return Area(slot, entry >> 9, entry & 63u, (entry & kEndsSouth) != 0u, (entry & kEndsWest) != 0u);
}

int half_at(uint first_word, uint i) { return bitfieldExtract(int(vertices[first_word + (i >> 1)]), int(i & 1u) * 16, 16); }
float upper_half_at(uint first_word, uint i) {
    return uintBitsToFloat((vertices[first_word + (i >> 1)] >> ((i & 1u) * 16u) & 0xffffu) << 16);
}

float key_of_area(uint slot, uint kind, uint square) { return keys[slot * kAreaKeys + kind * 64u + square]; }

// The key of a square's midpoint (or centre) in the area adjacent to one, beyond a column or row of 8
float key_beyond(uint chunk, uint area, uint side, uint kind, uint square) {
    uint column = area & 7u, row = area >> 3;
    uint owner = chunk;
    if (side == kEast) { if (column == 7u) owner = neighbour_of(chunk, side); column = (column + 1u) & 7u; }
    if (side == kNorth) { if (row == 7u) owner = neighbour_of(chunk, side); row = (row + 1u) & 7u; }
    if (side == kWest) { if (column == 0u) owner = neighbour_of(chunk, side); column = (column + 7u) & 7u; }
    if (side == kSouth) { if (row == 0u) owner = neighbour_of(chunk, side); row = (row + 7u) & 7u; }
    if (!is_open(owner)) return kNever;
    const uint slot = slot_of_area(owner, row * 8u + column);
    return slot == kNone ? kAboveFloor : key_of_area(slot, kind, square);
}
float side_key(uint chunk, uint side, uint i) {
    return keys[more_bases.x + chunk * 128u + (side == kNorth ? 64u : 0u) + i];
}
float coarse_key(uint root, uint column, uint row) { return keys[more_bases.y + root * kCoarse + row * kCoarseSide + column]; }

// Position of a column or row of an open chunk, relative to the eye
float position_of(uint chunk, uint axis, uint i) { return keys[more_bases.w + chunk * 258u + axis * 129u + i]; }

float threshold() { return uintBitsToFloat(state[kThreshold]); }
