// Tests the triangles of one chunk below a place: one group. See is_above_drawn_ground() of scene/culling/horizon_map.cpp.
layout(local_size_x = 64) in;
layout(location = 0) uniform uint chunk;
// the place relative to the chunk's south-western sample, and to height 0; spacing of the samples. Metres
layout(location = 1) uniform dvec4 place;
const double kEdge = 1e-9lf;  // a triangle extends this far beyond its edges, relative to its area

// A vertex relative to the place: see DeviceMesh
dvec3 corner_at(uint vertex) {
    const bool is_coarse = vertex >= 0x80000000u;
    const uint at = is_coarse ? (vertex - 0x80000000u) % kSamples : vertex % kAreaOffsets;
    const uint side = is_coarse ? 129u : 17u;
    uint column = at % side, row = at / side;
    const uint offset = is_coarse ? more_bases.z + kCoarse * chunk + row / 2u * kCoarseSide + column / 2u : vertex;
    if (!is_coarse) {
        const uint area = area_at(vertex / kAreaOffsets).area;
        column += area % 8u * 16u;
        row += area / 8u * 16u;
    }
    precise double height = origin_quantum.z * double(heights[slot_of(chunk) * kHeightWords + row * 129u + column]);
    if (options.y != 0u) height = height + double(offsets[offset]);
    precise dvec3 corner = dvec3(double(column), double(row), 0.0lf) * place.w;
    corner.z = height;
    corner -= place.xyz;
    return corner;
}
double cross2(dvec3 a, dvec3 b) {
    precise double area = a.x * b.y - a.y * b.x;
    return area;
}
void test(uint first, uint end, uint step) {
    for (uint i = first; i < end; i += step) {
        const dvec3 a = corner_at(indices[3u * i]), b = corner_at(indices[3u * i + 1u]), c = corner_at(indices[3u * i + 2u]);
        const double of_a = cross2(b, c), of_b = cross2(c, a), of_c = cross2(a, b);
        precise double area = of_a + of_b + of_c;
        precise double least = -kEdge * area;
        if (!(of_a >= least && of_b >= least && of_c >= least)) continue;
        precise double rise = of_a * a.z + of_b * b.z + of_c * c.z;
        atomicOr(state[kAbove], rise < 0.0lf ? 1u : 3u);
    }
}

void main() {
    const uint i = gl_LocalInvocationID.x, total = state[kTriangles];
    if (is_root(chunk)) {
        const uint first_area = work[bases.w];
        const uint end = chunk + 1u < counts.y ? state[kRootTriangles + chunk + 1u] : (state[kAreaTotal] > 0u ? first_area : total);
        test(state[kRootTriangles + chunk] + i, end, 64u);
    }
    if (!is_open(chunk)) return;
    const uint slot = slot_of_area(chunk, i);
    if (slot == kNone) return;
    test(work[bases.w + slot], slot + 1u < state[kAreaTotal] ? work[bases.w + slot + 1u] : total, 1u);
}
