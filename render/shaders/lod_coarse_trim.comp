// Raises the keys of the roots' vertices of coarser spacings to those of their parents, coarse to fine. One group.
layout(local_size_x = 256) in;

// The key of a centre that may be beyond a side
float centre_key(uint root, int column, int row) {
    uint owner = root;
    const bool beyond[4] = bool[4](column < 0, column > 64, row < 0, row > 64);
    for (uint side = 0u; side < 4u; ++side) {
        if (!beyond[side]) continue;
        if (is_at_border(root, side)) return 0.0;
        owner = neighbour_of(root, side);
    }
    if (owner == kNone) return kNever;
    const int c = column < 0 ? column + 64 : column > 64 ? column - 64 : column;
    const int r = row < 0 ? row + 64 : row > 64 ? row - 64 : row;
    return coarse_key(owner, uint(c), uint(r));
}

void main() {
    for (uint stride = 32u; stride >= 1u; stride /= 2u) {
        const uint per_side = 64u / stride + 1u, per_root = per_side * per_side;
        for (uint kind = 0u; kind < 2u; ++kind) {
            for (uint i = gl_LocalInvocationID.x; i < counts.y * per_root; i += 256u) {
                const uint root = i / per_root, at = i % per_root;
                const uint a = at % per_side, b = at / per_side;
                const bool is_centre = (a & b & 1u) != 0u;
                if (kind == 0u ? !is_centre || stride == 32u : ((a ^ b) & 1u) == 0u) continue;
                const int c = int(a * stride), r = int(b * stride), s = int(stride);
                ivec2 to;
                if (is_centre) {
                    to = ivec2(s, ((a / 2u + b / 2u) & 1u) == 0u ? -s : s);
                } else {
                    to = (b & 1u) != 0u ? ivec2(s, 0) : ivec2(0, s);
                }
                const float parents = max(centre_key(root, c + to.x, r + to.y), centre_key(root, c - to.x, r - to.y));
                const uint word = more_bases.y + root * kCoarse + b * stride * kCoarseSide + a * stride;
                keys[word] = max(keys[word], parents);
            }
            memoryBarrierBuffer();
            barrier();
        }
    }
}
