// Lists the open areas, and computes the positions of columns and rows of open chunks: one group for each chunk.
layout(local_size_x = 64) in;

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
    if (!is_open(chunk)) return;
    for (uint i = area; i < 258u; i += 64u)
        keys[options.w + chunk * 258u + i] = position_over_eye(chunk, i / 129u, i % 129u);
}
