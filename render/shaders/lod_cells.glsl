// Cells that are drawn undivided over an absent child, or at the finest spacing; of the areas that lod_count.comp lists.
struct Cells {
    uint error;     // of lod_error.glsl
    uint word;      // of the square
    ivec2 corner;   // of the square, as column and row of the chunk
};
// False if the square has none
bool find_cells(Area a, uint square, out Cells cells) {
    cells.error = level_of(a.chunk) == options.z ? kFinestError : kAbsentError;
    cells.word = stored_word(a.slot, square);
    cells.corner = ivec2((a.area & 7u) * 16u + 2u * (square & 7u), (a.area >> 3) * 16u + 2u * (square >> 3));
    return cells.word != kNone;
}
Area area_of_cells() { return area_at(work[last_bases.z + capacity.x + gl_WorkGroupID.x]); }
// A quarter is drawn as a cell if both of its sides are split.
bool is_cell(uint word, int k) {
    return (word >> k & 1u) != 0u && (word >> (k + 3 & 3) & 1u) != 0u && (word >> (4 + k) & 1u) == 0u;
}
ivec2 cell_of(Cells cells, int k) { return cells.corner + ivec2(k == 1 || k == 2 ? 1 : 0, k >= 2 ? 1 : 0); }
float bound_of_cell(uint chunk, ivec2 cell) {
    return intBitsToFloat(heights[slot_of(chunk) * kHeightWords + kSamples + uint(cell.y * 128 + cell.x)]);
}
// Corners of a cell in single precision, relative to the eye
void corners_of(uint chunk, ivec2 cell, out vec3 low, out vec3 high, out vec3 corner) {
    const uint first = slot_of(chunk) * kHeightWords + uint(cell.y * 129 + cell.x);
    const ivec4 z = ivec4(heights[first], heights[first + 1u], heights[first + 129u], heights[first + 130u]);
    const float unit = float(origin_quantum.z);
    // the height of the first sample exactly, the others from it
    const float z0 = float(origin_quantum.z * double(z.x) - eye_spacing.z);
    const vec3 rise = unit * vec3(z.y - z.x, z.z - z.x, z.w - z.x);
    corner = vec3(position_of(chunk, 0u, uint(cell.x)), position_of(chunk, 1u, uint(cell.y)), z0);
    low = vec3(corner.xy, z0 + min(min(rise.x, rise.y), min(rise.z, 0.0)));
    high = vec3(position_of(chunk, 0u, uint(cell.x) + 1u), position_of(chunk, 1u, uint(cell.y) + 1u),
                z0 + max(max(rise.x, rise.y), max(rise.z, 0.0)));
}
