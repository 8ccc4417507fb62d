// Keys of the roots' vertices of coarser spacings, coarse to fine. One group. Columns and rows count even samples.
layout(local_size_x = 256) in;

float own_coarse(uint root, uint column, uint row, uint stride, bool is_centre) {
    const vec4 reach = reaches[options.z + uint(findLSB(2u * stride))];
    const float width = is_centre ? reach.x : reach.z, up = is_centre ? reach.y : reach.w;
    precise double height = origin_quantum.z * double(heights[slot_of(root) * kHeightWords + 2u * row * 129u + 2u * column]);
    const float z = height_over_eye(height);
    precise float low = z - up;
    precise float high = z + up;
    return own_key(position_over_eye(root, 0u, 2u * column), position_over_eye(root, 1u, 2u * row), low, high, width,
                   uintBitsToFloat(vertices[more_bases.w + root * kCoarse + row * kCoarseSide + column]));
}

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
    for (uint root = 0u; root < counts.y; ++root) {
        if (gl_LocalInvocationID.x < 4u) {
            const uint corner = gl_LocalInvocationID.x;
            keys[more_bases.y + root * kCoarse + (corner >> 1) * 64u * kCoarseSide + (corner & 1u) * 64u] = kNever;
        }
    }
    for (uint stride = 32u; stride >= 1u; stride /= 2u) {
        const uint per_side = 64u / stride + 1u, per_root = per_side * per_side;
        for (uint kind = 0u; kind < 2u; ++kind) {
            for (uint i = gl_LocalInvocationID.x; i < counts.y * per_root; i += 256u) {
                const uint root = i / per_root, at = i % per_root;
                const uint a = at % per_side, b = at / per_side;
                const uint column = a * stride, row = b * stride;
                const bool is_centre = (a & b & 1u) != 0u;
                if (kind == 0u ? !is_centre : ((a ^ b) & 1u) == 0u) continue;
                float key = own_coarse(root, column, row, stride, is_centre);
                const int c = int(column), r = int(row), s = int(stride);
                if (is_centre && stride < 32u) {
                    const int other = ((a / 2u + b / 2u) & 1u) == 0u ? -s : s;
                    key = max_of(key, max_of(centre_key(root, c + s, r + other), centre_key(root, c - s, r - other)));
                } else if (!is_centre) {
                    const int to_x = (b & 1u) != 0u ? s : 0, to_y = (b & 1u) != 0u ? 0 : s;
                    key = max_of(key, max_of(centre_key(root, c - to_x, r - to_y), centre_key(root, c + to_x, r + to_y)));
                }
                keys[more_bases.y + root * kCoarse + row * kCoarseSide + column] = key;
            }
            memoryBarrierBuffer();
            barrier();
        }
    }
}
