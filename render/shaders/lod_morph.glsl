// Offsets of vertices: see morph_offset() of terrain/lod/key_kernels.h.

float morph_slope() { return uintBitsToFloat(state[kSlope]); }
float share_less_one(float key, float slope) {
    precise float product = slope * key;
    precise float wanted = max_of(scalars.w - product, 0.0);
    precise float less = (wanted < 1.0 ? wanted : 1.0) - 1.0;
    return less;
}
float morph_offset(float less_one, float rise, float offset_a, float offset_b) {
    precise float sum = offset_a + offset_b;
    precise float mean = 0.5 * sum;
    precise float moved = less_one * rise;
    precise float offset = mean + moved;
    return offset;
}
// Height of a sample of a chunk above the mean of two others, metres
float rise_between(uint chunk, uint at, uint end_a, uint end_b) {
    const uint first = slot_of(chunk) * kHeightWords;
    precise float from_a = float(heights[first + at] - heights[first + end_a]);
    precise float from_b = float(heights[first + at] - heights[first + end_b]);
    precise float sum = from_a + from_b;
    precise float half_quantum = 0.5 * float(origin_quantum.z);
    precise float rise = half_quantum * sum;
    return rise;
}
