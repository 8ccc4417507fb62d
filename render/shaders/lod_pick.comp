// Finds the bin in which the budget ends, and the next window: the bin, or all keys if the budget does not end in the
// window. One group.
layout(local_size_x = 1024) in;
layout(location = 0) uniform uint digit;  // as in lod_count_keys.comp
shared uint sums[1024];
shared uint chosen;

void search(uint low, uint high, uint shift) {
    state[kLow] = low;
    state[kHigh] = min(high, floatBitsToUint(scalars.z));
    state[kShift] = shift;
}
void search_groups(uint first, uint count) {
    // the steps that follow
    for (uint step = first; step < 5u; ++step) {
        state[kSearchGroups + 3u * step] = step < first + count ? kSearchers : 0u;
        state[kPickGroups + 3u * step] = step < first + count ? 1u : 0u;
    }
}
void find(uint bits) {
    state[kThreshold] = bits;
    search_groups(digit + 1u, 0u);
}

void main() {
    const uint i = gl_LocalInvocationID.x;
    const uint a = state[kBins + 2u * i], b = state[kBins + 2u * i + 1u];
    if (i == 0u) chosen = kNone;
    sums[i] = a + b;
    barrier();
    for (uint step = 1u; step < 1024u; step <<= 1) {
        const uint before = i >= step ? sums[i - step] : 0u;
        barrier();
        sums[i] += before;
        barrier();
    }
    const uint budget = counts.z;
    const uint below = state[kBelow], begin = below + sums[i] - a - b;
    if (below <= budget) {
        if (begin + a > budget) {
            atomicMin(chosen, 2u * i);
        } else if (begin + a + b > budget) {
            atomicMin(chosen, 2u * i + 1u);
        }
    }
    state[kBins + 2u * i] = state[kBins + 2u * i + 1u] = 0u;
    barrier();
    if (i != 0u) return;
    state[kBelow] = 0u;
    const uint low = state[kLow], high = state[kHigh], shift = state[kShift];
    if (chosen == kNone) {
        if (below <= budget && high == floatBitsToUint(scalars.z)) {
            find(high);  // everything below the floor fits
        } else {
            search(0u, kNone, 21u);
            search_groups(2u, 3u);
        }
        return;
    }
    const uint first = low + (chosen << shift);
    if (shift == 0u) {
        find(first);
    } else {
        const uint narrow = shift == 21u ? 10u : 0u;
        search(first, first + (1u << shift), narrow);
        if (digit == 0u) search_groups(1u, 1u);
    }
}
