// Lists the open areas, and computes the positions of columns and rows of open chunks: one group for each chunk.
layout(local_size_x = 64) in;

// High and low part of an integer: see SplitInteger
ivec2 split(double value) {
    const double high = floor((value + 524288.0lf) / 1048576.0lf);
    return ivec2(int(high), int(value - high * 1048576.0lf));
}
// Where an area is drawn, or a root's coarser triangles: area 64
void write_place(uint number, uint chunk, uint area) {
    const uint to = capacity.y + 12u * number;
    const ivec2 x = split(header(chunk, 0u) - eye_lattice.x), y = split(header(chunk, 2u) - eye_lattice.y);
    const ivec2 stride = split(header(chunk, 4u));
    const ivec4 corner = ivec4(x, y);
    for (int i = 0; i < 4; ++i) work[to + uint(i)] = uint(corner[i]);
    work[to + 4u] = uint(stride.x);
    work[to + 5u] = uint(stride.y);
    work[to + 6u] = slot_of(chunk) * kHeightWords;
    work[to + 7u] = area;
    work[to + 8u] = chunk;
}

void main() {
    const uint chunk = gl_WorkGroupID.x, area = gl_LocalInvocationID.x;
    const uint low = open_mask(chunk, 0u), high = open_mask(chunk, 1u);
    const uint own = area < 32u ? low : high;
    uint slot = kNone;
    if ((own >> (area & 31u) & 1u) != 0u) {
        const uint below = own & ((1u << (area & 31u)) - 1u);
        slot = work[3u * chunk + 2u] + bitCount(below) + (area < 32u ? 0u : bitCount(low));
        const bool ends_south = (area >> 3) == 0u && is_at_border(chunk, kSouth);
        const bool ends_west = (area & 7u) == 0u && is_at_border(chunk, kWest);
        work[bases.x + slot] = chunk << 9 | (ends_west ? kEndsWest : 0u) | (ends_south ? kEndsSouth : 0u) | area;
    }
    work[bases.y + 64u * chunk + area] = slot;
    if (slot != kNone) write_place(slot, chunk, area);
    if (area == 0u && is_root(chunk)) write_place(capacity.x + chunk, chunk, 64u);
    if (!is_open(chunk)) return;
    for (uint i = area; i < 258u; i += 64u)
        keys[more_bases.w + chunk * 258u + i] = position_over_eye(chunk, i / 129u, i % 129u);
}
