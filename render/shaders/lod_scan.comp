// Numbers the open areas in the order of their chunks, and counts them by level. One group.
layout(local_size_x = 1024) in;
shared uint sums[1024];
shared uint carried;

uint prefix_sum(uint value) {
    const uint i = gl_LocalInvocationID.x;
    sums[i] = value;
    barrier();
    for (uint step = 1u; step < 1024u; step <<= 1) {
        const uint before = i >= step ? sums[i - step] : 0u;
        barrier();
        sums[i] += before;
        barrier();
    }
    return sums[i] - value;
}

void main() {
    const uint i = gl_LocalInvocationID.x;
    if (i == 0u) carried = 0u;
    for (uint first = 0u; first < counts.x; first += 1024u) {
        const uint chunk = first + i;
        const bool has_chunk = chunk < counts.x;
        const uint own = has_chunk ? bitCount(work[3u * chunk]) + bitCount(work[3u * chunk + 1u]) : 0u;
        barrier();
        const uint begin = carried + prefix_sum(own);
        if (has_chunk && work[3u * chunk + 2u] != kNone) work[3u * chunk + 2u] = begin;
        if (has_chunk) {
            const uint level = level_of(chunk);
            if (chunk == level_first[level >> 2][level & 3u]) state[kLevelAreas + level] = begin;
        }
        barrier();
        if (i == 1023u) carried = begin + own;
        barrier();
    }
    memoryBarrierBuffer();
    barrier();
    if (i == 0u) {
        state[kAreaTotal] = carried;
        state[kAllGroups] = carried;
        state[kAllGroups + 1u] = state[kAllGroups + 2u] = 1u;
        state[kLevelAreas + options.x] = carried;
    }
    // levels without chunks are the last
    if (i < options.x && level_first[i >> 2][i & 3u] >= counts.x) state[kLevelAreas + i] = carried;
    memoryBarrierBuffer();
    barrier();
    if (i < options.x) {
        state[kLevelGroups + 3u * i] = state[kLevelAreas + i + 1u] - state[kLevelAreas + i];
        state[kLevelGroups + 3u * i + 1u] = state[kLevelGroups + 3u * i + 2u] = 1u;
    }
    for (uint bin = i; bin < kBinCount; bin += 1024u) state[kBins + bin] = 0u;
    if (i == 0u) {
        state[kThreshold] = 0u;
        for (uint residual = 0u; residual < 7u; ++residual) state[kResiduals + residual] = 0u;
        state[kBelow] = 0u;
        state[kCandidates] = state[kErrorGroups] = state[kHeldGroups] = state[kCellGroups] = 0u;
        state[kErrorGroups + 1u] = state[kErrorGroups + 2u] = 1u;
        state[kHeldGroups + 1u] = state[kHeldGroups + 2u] = 1u;
        state[kCellGroups + 1u] = state[kCellGroups + 2u] = 1u;
        const uint low = floatBitsToUint(guess.x);
        state[kLow] = low;
        state[kHigh] = min(low + (kBinCount << kWindowShift), floatBitsToUint(scalars.z));
        state[kShift] = kWindowShift;
        for (uint step = 0u; step < 5u; ++step) {
            state[kSearchGroups + 3u * step] = step == 0u ? kSearchers : 0u;
            state[kPickGroups + 3u * step] = step == 0u ? 1u : 0u;
            state[kSearchGroups + 3u * step + 1u] = state[kSearchGroups + 3u * step + 2u] = 1u;
            state[kPickGroups + 3u * step + 1u] = state[kPickGroups + 3u * step + 2u] = 1u;
        }
    }
}
