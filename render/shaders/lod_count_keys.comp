// Adds the weights of the keys of a window by bins: a step of the selection. Keys below the window are summed.
layout(local_size_x = 64) in;
layout(location = 0) uniform uint digit;  // 0: of the window, 1: of its bin, 2 to 4: of all keys
shared uint bins[kBinCount];
shared uint sum_below;

uint low = 0u, high = 0u, shift = 0u;  // bits of keys; positive floats have their order
uint below = 0u;

void add(float key, uint weight) {
    const uint bits = floatBitsToUint(key);
    if (bits < low) {
        below += weight;
    } else if (bits < high) {
        atomicAdd(bins[(bits - low) >> shift], weight);
    }
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
    const uint i = gl_LocalInvocationID.x;
    for (uint bin = i; bin < kBinCount; bin += 64u) bins[bin] = 0u;
    if (i == 0u) sum_below = 0u;
    low = state[kLow];
    high = state[kHigh];
    shift = state[kShift];
    barrier();
    const uint area_count = state[kAreaTotal];
    for (uint slot = gl_WorkGroupID.x; slot < area_count; slot += gl_NumWorkGroups.x) {
        const uint entry = work[bases.x + slot], first = slot * kAreaKeys + i;
        add(keys[first], 2u);
        add(keys[first + 64u], i < 8u && (entry & kEndsSouth) != 0u ? 1u : 2u);
        add(keys[first + 128u], (i & 7u) == 0u && (entry & kEndsWest) != 0u ? 1u : 2u);
    }
    const uint thread = gl_GlobalInvocationID.x, threads = 64u * gl_NumWorkGroups.x;
    for (uint k = thread; k < counts.x * 128u; k += threads) {
        const uint chunk = k / 128u;
        if (is_at_border(chunk, (k & 64u) != 0u ? kNorth : kEast) && is_open(chunk)) add(keys[more_bases.x + k], 1u);
    }
    for (uint k = thread; k < counts.y * kCoarse; k += threads) add_coarse(k / kCoarse, k % kCoarse);
    const uint demands = counts.x * (kTableWords + kFrameWords);
    for (uint k = thread; k < counts.w; k += threads)
        add(uintBitsToFloat(chunks[demands + 2u * k]), chunks[demands + 2u * k + 1u]);
    if (below != 0u) atomicAdd(sum_below, below);
    barrier();
    for (uint bin = i; bin < kBinCount; bin += 64u)
        if (bins[bin] != 0u) atomicAdd(state[kBins + bin], bins[bin]);
    if (i == 0u && sum_below != 0u) atomicAdd(state[kBelow], sum_below);
}
