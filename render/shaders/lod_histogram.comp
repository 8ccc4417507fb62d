// Adds the weights of the keys below the floor by one digit: a step of the radix selection.
layout(local_size_x = 256) in;
layout(location = 0) uniform uint shift;  // of the digit: 21, 10, 0
shared uint bins[kBinCount];

void add(float key, uint weight) {
    if (!(key < scalars.z)) return;
    const uint bits = floatBitsToUint(key);
    const uint digit_bits = shift == 0u ? 10u : 11u;
    if (shift != 21u && bits >> (shift + digit_bits) != state[kPrefix]) return;
    atomicAdd(bins[bits >> shift & ((1u << digit_bits) - 1u)], weight);
}

// Vertices on a line between roots are counted with the root to the east or north of it.
void add_coarse(uint root, uint at) {
    const uint column = at % kCoarseSide, row = at / kCoarseSide;
    if (row == 64u && !is_at_border(root, kNorth)) return;
    const bool is_border_row = row == 64u || (row == 0u && is_at_border(root, kSouth));
    if (!is_border_row && column == 64u && !is_at_border(root, kEast)) return;
    const bool is_border = is_border_row || column == 64u || (column == 0u && is_at_border(root, kWest));
    add(coarse_key(root, column, row), is_border ? 1u : 2u);
}

void main() {
    for (uint bin = gl_LocalInvocationID.x; bin < kBinCount; bin += 256u) bins[bin] = 0u;
    barrier();
    if (state[kIsFound] == 0u) {
        const uint first = gl_GlobalInvocationID.x, threads = 256u * gl_NumWorkGroups.x;
        const uint key_count = state[kAreaTotal] * kAreaKeys;
        for (uint i = first; i < key_count; i += threads) {
            const uint square = i & 63u, kind = i / 64u % 3u;
            const uint entry = work[bases.x + i / kAreaKeys];
            const bool is_border = kind == kAlongX ? square < 8u && (entry & 64u) != 0u
                                                   : kind == kAlongY && (square & 7u) == 0u && (entry & 128u) != 0u;
            add(keys[i], is_border ? 1u : 2u);
        }
        for (uint i = first; i < counts.x * 128u; i += threads) {
            const uint chunk = i / 128u, side = (i & 64u) != 0u ? kNorth : kEast;
            if (is_at_border(chunk, side) && is_open(chunk)) add(keys[more_bases.x + i], 1u);
        }
        for (uint i = first; i < counts.y * kCoarse; i += threads) add_coarse(i / kCoarse, i % kCoarse);
        const uint demands = counts.x * (kTableWords + kFrameWords);
        for (uint i = first; i < counts.w; i += threads)
            add(uintBitsToFloat(chunks[demands + 2u * i]), chunks[demands + 2u * i + 1u]);
    }
    barrier();
    for (uint bin = gl_LocalInvocationID.x; bin < kBinCount; bin += 256u)
        if (bins[bin] != 0u) atomicAdd(state[kBins + bin], bins[bin]);
}
