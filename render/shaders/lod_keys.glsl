// Keys of vertices: see vertex_key() and outside_factor() of terrain/lod/key_kernels.h.
const float kLeastWeight = 1.0 / 16.0;
const float kWeightSlope = 6.0;

float clamped(double metres) { return float(clamp(metres, -1e16lf, 1e16lf)); }
// Position of a column or row of any chunk, relative to the eye
float position_over_eye(uint chunk, uint axis, uint i) {
    precise double index = header(chunk, 2u * axis) + double(i) * header(chunk, 4u);
    precise double metres = eye_spacing.w * index;
    metres = (axis == 0u ? origin_quantum.x : origin_quantum.y) + metres;
    precise double from_eye = metres - (axis == 0u ? eye_spacing.x : eye_spacing.y);
    return clamped(from_eye);
}
float height_over_eye(double height) {
    precise double over = height - eye_spacing.z;
    return clamped(over);
}
float max_of(float a, float b) { return a > b ? a : b; }
float absolute(float a) { return max_of(a, -a); }
float gap_squared(float from_eye, float reach) {
    precise float gap = max_of(absolute(from_eye) - reach, 0.0);
    precise float squared = gap * gap;
    return squared;
}
float reciprocal(float value) {
    precise float inverse = intBitsToFloat(0x7ef311c3 - floatBitsToInt(value));
    for (int i = 0; i < 3; ++i) {
        precise float product = value * inverse;
        precise float left = 2.0 - product;
        inverse = inverse * left;
    }
    return inverse;
}
float outside_factor(float x, float y, float low, float high, float half_width) {
    precise float far = absolute(x) + absolute(y);
    far = far + max_of(absolute(low), absolute(high));
    float outside = 0.0;
    for (int i = 0; i < 4; ++i) {
        const float nx = planes[i].x, ny = planes[i].y, nz = planes[i].z;
        precise float product = ny * y;
        precise float both = absolute(nx) + absolute(ny);
        precise float wide = both * half_width;
        precise float from_y = product + wide;
        precise float along_x = nx * x;
        precise float inside = along_x + from_y;
        precise float along_z = nz > 0.0 ? nz * high : nz * low;
        inside = inside + along_z;
        precise float margin = far * (1.0 / 262144.0);
        inside = inside + margin;
        outside = max_of(-inside, outside);
    }
    precise float twice = 2.0 * half_width;
    precise float around = twice + scalars.y;
    precise float reach = far + around;
    precise float loss = kWeightSlope * outside;
    precise float kept = reach - loss;
    precise float least = kLeastWeight * reach;
    precise float inverse = reach * reciprocal(max_of(kept, least));
    precise float factor = inverse * inverse;
    return outside > 0.0 ? factor : 1.0;
}
float own_key(float x, float y, float low, float high, float half_width, float inverse_square_bound) {
    precise float flat_squared = gap_squared(x, half_width) + gap_squared(y, half_width);
    const float gap = max_of(max_of(low, -high), 0.0);
    precise float gap_2 = gap * gap;
    precise float distance_squared = flat_squared + gap_2;
    precise float key = max_of(distance_squared, scalars.x) * inverse_square_bound;
    precise float weighed = key * outside_factor(x, y, low, high, half_width);
    return weighed;
}
float over_eye(int height, float unit, float base) {
    precise float metres = float(height) * unit;
    precise float over = metres + base;
    return over;
}
float reach_unit(uint chunk) { return uintBitsToFloat(vertices[vertex_words(chunk) + kHeaderWord + 8u]); }
float reach_base(uint chunk) { return height_over_eye(header(chunk, 6u)); }
// Half widths of the reaches of a chunk's own centres and midpoints
float centre_width(uint chunk) { return reaches[options.z - level_of(chunk)].x; }
float midpoint_width(uint chunk) { return reaches[options.z - level_of(chunk)].z; }

double lattice_at(uint word) { return packDouble2x32(uvec2(chunks[word], chunks[word + 1u])); }
// Whether a rectangle at a word of chunks[] and another one (west, south, east, north) overlap
bool overlaps(uint word, dvec4 other) {
    return lattice_at(word) <= other.z && lattice_at(word + 2u) <= other.w && lattice_at(word + 4u) >= other.x &&
           lattice_at(word + 6u) >= other.y;
}
// The least key, below a limit, of the pins that overlap a rectangle; else the limit
float least_pin_key(dvec4 rect, float limit) {
    float least = limit;
    for (uint group = 0u; group < options.w; ++group) {
        const float key = key_of_group(group);
        if (!(key < least) || !overlaps(group_words(group), rect)) continue;
        for (uint pin = first_pin(group); pin < end_pin(group) && key < least; ++pin)
            if (overlaps(pin_words(pin), rect)) least = key;
    }
    return least;
}
// The key of a vertex of a chunk, lowered to those of pins: SolidPins::lowered(). `stride` is its spacing in samples.
float lowered(uint chunk, uint column, uint row, uint stride, bool is_centre, float key) {
    if (!is_pinned(chunk)) return key;
    const double step = header(chunk, 4u), reach = double((is_centre ? 3u : 2u) * stride) * step;
    const dvec2 at = dvec2(header(chunk, 0u), header(chunk, 2u)) + step * dvec2(double(column), double(row));
    return least_pin_key(dvec4(at - reach, at + reach), key);
}

// Own key of a vertex of an area
float own_key_of(Area a, uint kind, uint square, float x, float y, float half_width, float unit, float base) {
    const uint words = vertex_words(a.chunk) + a.area * kAreaWords;
    const float key = own_key(x, y, over_eye(half_at(words + 96u + 32u * kind, square), unit, base),
                              over_eye(half_at(words + 192u + 32u * kind, square), unit, base), half_width,
                              upper_half_at(words + 32u * kind, square));
    const uint column = (a.area & 7u) * 16u + 2u * (square & 7u) + (kind == kAlongY ? 0u : 1u);
    const uint row = (a.area >> 3) * 16u + 2u * (square >> 3) + (kind == kAlongX ? 0u : 1u);
    return lowered(a.chunk, column, row, 1u, kind == kCentre, key);
}
// Inverse square of the bound of a midpoint on the eastern or northern side, and its own key
float side_bound(uint chunk, uint side, uint along) {
    return upper_half_at(vertex_words(chunk) + (side == kEast ? kEastWord : kNorthWord), along);
}
float own_side_key(uint chunk, uint side, uint along) {
    const uint words = vertex_words(chunk) + (side == kEast ? kEastWord : kNorthWord);
    const uint column = side == kEast ? 128u : 2u * along + 1u, row = side == kEast ? 2u * along + 1u : 128u;
    const float unit = reach_unit(chunk), base = reach_base(chunk);
    const float key = own_key(position_of(chunk, 0u, column), position_of(chunk, 1u, row),
                              over_eye(half_at(words + 32u, along), unit, base),
                              over_eye(half_at(words + 64u, along), unit, base), midpoint_width(chunk),
                              side_bound(chunk, side, along));
    return lowered(chunk, column, row, 1u, false, key);
}

// The key of a vertex, raised to its parents'; lists the area if the vertex is thereby held.
float raised(Area a, float key, float parents) {
    precise float nested = key * kNestMargin;
    if (key < scalars.z && nested < parents && (atomicOr(work[bases.x + a.slot], kHeld) & kHeld) == 0u)
        work[last_bases.z + atomicAdd(state[kHeldGroups], 1u)] = a.slot;
    return max_of(key, parents);
}
