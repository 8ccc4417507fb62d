// Own key of a root's vertex of a coarser spacing, not of its corners. Column and row count even samples.
float own_coarse_key(uint root, uint column, uint row) {
    const uint stride = 1u << findLSB(column | row);
    const bool is_centre = (column / stride & row / stride & 1u) != 0u;
    const vec4 reach = reaches[options.z + uint(findLSB(2u * stride))];
    const float width = is_centre ? reach.x : reach.z, up = is_centre ? reach.y : reach.w;
    precise double height = origin_quantum.z * double(heights[slot_of(root) * kHeightWords + 2u * row * 129u + 2u * column]);
    const float z = height_over_eye(height);
    precise float low = z - up;
    precise float high = z + up;
    const float key = own_key(position_of(root, 0u, 2u * column), position_of(root, 1u, 2u * row), low, high, width,
                              uintBitsToFloat(vertices[root * kCoarse + row * kCoarseSide + column]));
    return lowered(root, 2u * column, 2u * row, 2u * stride, is_centre, key);
}
