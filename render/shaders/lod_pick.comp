// Finds the bin in which the budget ends. One group.
layout(local_size_x = 1024) in;
layout(location = 0) uniform uint shift;
shared uint sums[1024];
shared uint chosen;

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
    const uint used = state[kUsed];
    const bool was_found = state[kIsFound] != 0u;
    const uint begin = used + sums[i] - a - b;
    if (begin + a > counts.z) {
        atomicMin(chosen, 2u * i);
    } else if (begin + a + b > counts.z) {
        atomicMin(chosen, 2u * i + 1u);
    }
    state[kBins + 2u * i] = state[kBins + 2u * i + 1u] = 0u;
    barrier();
    if (was_found) return;
    if (chosen == kNone) {
        // only at the first digit: everything below the floor fits
        if (i == 0u) {
            state[kThreshold] = floatBitsToUint(scalars.z);
            state[kIsFound] = 1u;
        }
        return;
    }
    if (i != chosen / 2u) return;
    state[kUsed] = (chosen & 1u) != 0u ? begin + a : begin;
    const uint prefix = state[kPrefix] << (shift == 0u ? 10u : 11u) | chosen;
    state[kPrefix] = prefix;
    if (shift == 0u) {
        state[kThreshold] = prefix;
        state[kIsFound] = 1u;
    }
}
