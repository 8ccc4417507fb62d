// Own keys of the roots' vertices of coarser spacings. Columns and rows count even samples.
layout(local_size_x = 64) in;

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= counts.y * kCoarse) return;
    const uint root = i / kCoarse, column = i % kCoarse % kCoarseSide, row = i % kCoarse / kCoarseSide;
    const uint both = column | row;
    float key = kNever;  // corners of the root square
    if (both % 64u != 0u) {
        const uint stride = 1u << findLSB(both);
        const bool is_centre = (column / stride & row / stride & 1u) != 0u;
        const vec4 reach = reaches[options.z + uint(findLSB(2u * stride))];
        const float width = is_centre ? reach.x : reach.z, up = is_centre ? reach.y : reach.w;
        precise double height = origin_quantum.z * double(heights[slot_of(root) * kHeightWords + 2u * row * 129u + 2u * column]);
        const float z = height_over_eye(height);
        precise float low = z - up;
        precise float high = z + up;
        key = own_key(position_of(root, 0u, 2u * column), position_of(root, 1u, 2u * row), low, high, width,
                      uintBitsToFloat(vertices[more_bases.w + i]));
    }
    keys[more_bases.y + i] = key;
}
