// Offsets of the roots' vertices of coarser spacings, coarse to fine: one group for each root. Columns and rows count
// even samples.
layout(local_size_x = 256) in;
uint at(uint root, int column, int row) { return more_bases.z + root * kCoarse + uint(row) * kCoarseSide + uint(column); }
uint sample_at(int column, int row) { return uint(2 * row * 129 + 2 * column); }

void main() {
    const uint root = gl_WorkGroupID.x;
    const float slope = morph_slope();
    if (gl_LocalInvocationID.x < 4u)
        offsets[at(root, int(gl_LocalInvocationID.x & 1u) * 64, int(gl_LocalInvocationID.x >> 1) * 64)] = 0.0;
    memoryBarrierBuffer();
    barrier();
    for (int stride = 32; stride >= 1; stride /= 2) {
        const int per_side = 64 / stride + 1;
        for (int kind = 0; kind < 2; ++kind) {
            for (int i = int(gl_LocalInvocationID.x); i < per_side * per_side; i += 256) {
                const int a = i % per_side, b = i / per_side;
                const bool is_centre = (a & b & 1) != 0;
                if (kind == 0 ? !is_centre : ((a ^ b) & 1) == 0) continue;
                const int column = a * stride, row = b * stride;
                ivec2 to;
                if (is_centre) {
                    const bool first_rises = stride == 32 ? is_cut_to_north_east(root) : true;
                    const bool rises = ((a / 2 + b / 2) & 1) == 0 ? first_rises : !first_rises;
                    to = ivec2(stride, rises ? stride : -stride);
                } else {
                    to = (b & 1) != 0 ? ivec2(0, stride) : ivec2(stride, 0);
                }
                const float rise = rise_between(root, sample_at(column, row), sample_at(column - to.x, row - to.y),
                                                sample_at(column + to.x, row + to.y));
                offsets[at(root, column, row)] =
                    morph_offset(share_less_one(coarse_key(root, uint(column), uint(row)), slope), rise,
                                 offsets[at(root, column - to.x, row - to.y)], offsets[at(root, column + to.x, row + to.y)]);
            }
            memoryBarrierBuffer();
            barrier();
        }
    }
}
