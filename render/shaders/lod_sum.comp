// Places of the triangles: first those of the roots' coarser spacings, then the areas in their order. One group.
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
    const uint areas = state[kAreaTotal], total = counts.y + areas;
    for (uint first = 0u; first < total; first += 1024u) {
        const uint item = first + i;
        uint own = 0u;
        if (item < counts.y) own = state[kRootTriangles + item];
        else if (item < total) own = work[bases.w + item - counts.y];
        barrier();
        const uint begin = carried + prefix_sum(own);
        if (item < counts.y) state[kRootTriangles + item] = begin;
        else if (item < total) work[bases.w + item - counts.y] = begin;
        barrier();
        if (i == 1023u) carried = begin + own;
        barrier();
    }
    if (i != 0u) return;
    state[kTriangles] = carried;
    state[kDraw] = 3u * carried;
    state[kDraw + 1u] = 1u;
    state[kDraw + 2u] = state[kDraw + 3u] = state[kDraw + 4u] = 0u;
}
