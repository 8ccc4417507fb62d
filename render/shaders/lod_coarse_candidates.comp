// Lists the roots' vertices of coarser spacings that are held.
layout(local_size_x = 64) in;

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= counts.y * kCoarse) return;
    const uint root = i / kCoarse, column = i % kCoarse % kCoarseSide, row = i % kCoarse / kCoarseSide;
    if ((column | row) % 64u == 0u) return;  // corners of the root square
    const int stride = 2 << findLSB(column | row);
    visit_vertex(root, 2 * int(column), 2 * int(row), stride, own_coarse_key(root, column, row),
                 uintBitsToFloat(vertices[i]));
}
