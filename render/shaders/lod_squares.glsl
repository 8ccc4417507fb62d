// Squares of an area: which sides are split, which quarters divided. See area_bits() of terrain/lod/emission.cpp.
bool bit_of(uint slot, uint kind, uint square) {
    return (work[bases.z + 6u * slot + 2u * kind + (square >> 5)] >> (square & 31u) & 1u) != 0u;
}
// Whether a midpoint on an area's eastern or northern side is active
bool is_side_active(uint chunk, uint area, uint side, uint i) {
    const uint column = area & 7u, row = area >> 3;
    const bool leaves = side == kEast ? column == 7u : row == 7u;
    if (leaves && is_at_border(chunk, side)) return side_key(chunk, side, (side == kEast ? row : column) * 8u + i) < threshold();
    const uint owner = leaves ? neighbour_of(chunk, side) : chunk;
    if (!is_open(owner)) return false;
    const uint slot = slot_of_area(owner, side == kEast ? row * 8u + (column + 1u & 7u) : (row + 1u & 7u) * 8u + column);
    return slot != kNone && bit_of(slot, side == kEast ? kAlongY : kAlongX, side == kEast ? i * 8u : i);
}
// Bit k: side k is split; bit 4 + k: quarter k is divided. The centre must be active.
uint word_of(Area a, uint square) {
    const uint column = square & 7u, row = square >> 3;
    uint word = 0u;
    if (bit_of(a.slot, kAlongX, square)) word |= 1u;
    if (column < 7u ? bit_of(a.slot, kAlongY, square + 1u) : is_side_active(a.chunk, a.area, kEast, row)) word |= 2u;
    if (row < 7u ? bit_of(a.slot, kAlongX, square + 8u) : is_side_active(a.chunk, a.area, kNorth, column)) word |= 4u;
    if (bit_of(a.slot, kAlongY, square)) word |= 8u;
    const uint area_column = a.area & 7u, area_row = a.area >> 3;
    const uint child = child_of(a.chunk, area_column / 4u + 2u * (area_row / 4u));
    if (!is_open(child)) return word;
    const uint below = slot_of_area(child, (area_row % 4u * 2u + row / 4u) * 8u + area_column % 4u * 2u + column / 4u);
    if (below == kNone) return word;
    const uint first = (row % 4u * 2u) * 8u + column % 4u * 2u;
    if (bit_of(below, kCentre, first)) word |= 16u;
    if (bit_of(below, kCentre, first + 1u)) word |= 32u;
    if (bit_of(below, kCentre, first + 9u)) word |= 64u;
    if (bit_of(below, kCentre, first + 8u)) word |= 128u;
    return word;
}
// Squares of an area, written by lod_count.comp: bit i of mask 0 is set if the centre of square i is active, of mask 1 + k
// if bit k of its word is set.
uint square_mask(uint slot, uint mask, uint half_index) { return work[last_bases.x + 18u * slot + 2u * mask + half_index]; }
// The word of a square with an active centre, else kNone
uint stored_word(uint slot, uint square) {
    const uint half_index = square >> 5, bit = square & 31u;
    uint word = 0u;
    for (uint k = 0u; k < 8u; ++k) word |= (square_mask(slot, 1u + k, half_index) >> bit & 1u) << k;
    return (square_mask(slot, 0u, half_index) >> bit & 1u) != 0u ? word : kNone;
}
// Triangles of the squares before a square
uint triangles_before(uint slot, uint square) {
    const uint low = square < 32u ? (1u << square) - 1u : kNone, high = square < 32u ? 0u : (1u << (square - 32u)) - 1u;
    uint count = 4u * (bitCount(square_mask(slot, 0u, 0u) & low) + bitCount(square_mask(slot, 0u, 1u) & high));
    for (uint k = 1u; k <= 8u; ++k) {
        const uint ones = bitCount(square_mask(slot, k, 0u) & low) + bitCount(square_mask(slot, k, 1u) & high);
        count = k <= 4u ? count + ones : count - 2u * ones;
    }
    return count;
}
// The pin of the triangles of an area that a drawn volume replaces; kNone if there are none. The flag of a chunk's volumes
// says whether their triangles are in place (lod_in_place.comp), then whether they are drawn.
uint drawn_pin(uint chunk, uint area) {
    const uint group = group_of(chunk);
    if (group == kNone || work[capacity.w + group] == 0u) return kNone;
    for (uint pin = first_pin(group); pin < end_pin(group); ++pin)
        if (area_of_pin(pin) == area) return pin;
    return kNone;
}
// Replaced triangles of the squares before a square, of 64: all
uint replaced_before(uint pin, uint square) {
    if (pin == kNone) return 0u;
    const uint low = square < 32u ? (1u << square) - 1u : kNone;
    const uint high = square < 32u ? 0u : square < 64u ? (1u << (square - 32u)) - 1u : kNone;
    uint count = 0u;
    for (uint k = 0u; k < 8u; ++k)
        count += bitCount(replaced_squares(pin, k, 0u) & low) + bitCount(replaced_squares(pin, k, 1u) & high);
    return count;
}
// Bit k: triangle k of a square is replaced
uint replaced_word(uint pin, uint square) {
    if (pin == kNone) return 0u;
    uint word = 0u;
    for (uint k = 0u; k < 8u; ++k) word |= (replaced_squares(pin, k, square >> 5) >> (square & 31u) & 1u) << k;
    return word;
}
// Whether the chunk below an area is absent. Chunks with a fade of 0 have an infinite key.
bool is_child_absent(Area a) {
    const uint child = child_of(a.chunk, (a.area & 7u) / 4u + 2u * ((a.area >> 3) / 4u));
    return child == kNone || isinf(least_key(child));
}
uint triangles_of(uint word) { return 4u + bitCount(word & 15u) - 2u * bitCount(word >> 4); }

// Vertices of a square's triangles, counter-clockwise from above, by steps from its centre. The order of make_shape() of
// terrain/lod/emission.cpp.
const ivec2 kCorner[4] = ivec2[4](ivec2(-1, -1), ivec2(1, -1), ivec2(1, 1), ivec2(-1, 1));
const ivec2 kMiddle[4] = ivec2[4](ivec2(0, -1), ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0));
void write_triangle(inout uint at, uint a, uint b, uint c) {
    indices[at] = a;
    indices[at + 1u] = b;
    indices[at + 2u] = c;
    at += 3u;
}
// `side` is the number of samples in a row, `stride` the half side of the square in samples, `replaced` as replaced_word()
void write_square(uint word, uint replaced, uint centre, int side, int stride, uint at) {
    for (int k = 0; k < 4; ++k) {
        const int next = (k + 1) & 3;
        const uint begin = uint(int(centre) + stride * (kCorner[k].y * side + kCorner[k].x));
        const uint end = uint(int(centre) + stride * (kCorner[next].y * side + kCorner[next].x));
        const uint middle = uint(int(centre) + stride * (kMiddle[k].y * side + kMiddle[k].x));
        if ((word >> k & 1u) == 0u) {
            write_triangle(at, begin, end, centre);
            continue;
        }
        const uint divided = word >> 4, of_side = replaced >> (2 * k);
        if ((divided >> k & 1u) == 0u && (of_side & 1u) == 0u) write_triangle(at, begin, middle, centre);
        if ((divided >> next & 1u) == 0u && (of_side & 2u) == 0u) write_triangle(at, middle, end, centre);
    }
}
