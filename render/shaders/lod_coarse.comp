// Own keys of the roots' vertices of coarser spacings.
layout(local_size_x = 64) in;

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= counts.y * kCoarse) return;
    const uint root = i / kCoarse, column = i % kCoarse % kCoarseSide, row = i % kCoarse / kCoarseSide;
    // corners of the root square are no vertices
    keys[more_bases.y + i] = (column | row) % 64u == 0u ? kNever : own_coarse_key(root, column, row);
}
