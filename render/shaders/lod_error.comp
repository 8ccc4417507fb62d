// Errors of the candidates, in double precision: divisions and roots are iterations of products, so that no error exceeds
// 1e-9 of a value. What is added covers it.
layout(local_size_x = 32) in;

double inverse_of(double value) {
    double inverse = double(1.0 / float(value));
    for (int i = 0; i < 3; ++i) inverse = inverse * (2.0lf - value * inverse);
    return inverse;
}
double root_of(double value) {
    if (!(value > 1e-30lf)) return 0.0lf;
    double inverse = double(inversesqrt(float(value)));
    for (int i = 0; i < 3; ++i) inverse = inverse * (1.5lf - 0.5lf * value * inverse * inverse);
    return value * inverse;
}
float rounded_up(double value) { return float(min(value * double(kRoundUp), 3e38lf)); }

double near_squared(double gap_squared, double slack) {
    const double distance = max(root_of(gap_squared) - slack, 0.0lf);
    const double least = max(max(origin_quantum.w, distances.x), distance);
    return least * least;
}
// Square of bound over distance for the part of a triangle that may be in view, points relative to the eye; 0 if no part is.
double ratio_in_view(dvec3 a, dvec3 b, dvec3 c, double bound) {
    dvec3 part[8], next[8];
    part[0] = a;
    part[1] = b;
    part[2] = c;
    int count = 3;
    const dvec3 most = max(max(abs(a), abs(b)), abs(c));
    const double slack = 1e-9lf * (max(max(most.x, most.y), most.z) + bound);
    for (int plane = 0; plane < 4; ++plane) {
        const dvec3 n = normals[plane].xyz;
        const double least = -abs(n.z) * bound - slack;
        int kept = 0;
        for (int i = 0; i < count; ++i) {
            const dvec3 from = part[i], to = part[i + 1 < count ? i + 1 : 0];
            const double above_from = dot(n, from) - least, above_to = dot(n, to) - least;
            if (above_from >= 0.0lf) next[kept++] = from;
            if ((above_from >= 0.0lf) != (above_to >= 0.0lf))
                next[kept++] = from + above_from * inverse_of(above_from - above_to) * (to - from);
        }
        if (kept == 0) return 0.0lf;
        for (int i = 0; i < kept; ++i) part[i] = next[i];
        count = kept;
    }
    dvec3 low = part[0], high = part[0];
    for (int i = 1; i < count; ++i) {
        low = min(low, part[i]);
        high = max(high, part[i]);
    }
    low.z -= bound;
    high.z += bound;
    const dvec3 gap = max(max(low, -high), dvec3(0.0lf));
    return bound * bound * inverse_of(near_squared(dot(gap, gap), slack));
}
// The same for 1 m anywhere in a box; 0 if no part of it is in view.
double ratio_of_box(dvec3 low, dvec3 high) {
    const dvec3 most = max(abs(low), abs(high));
    const double slack = 2e-9lf * max(max(most.x, most.y), most.z);
    for (int plane = 0; plane < 4; ++plane) {
        const dvec3 n = normals[plane].xyz;
        const dvec3 support = dvec3(n.x > 0.0lf ? high.x : low.x, n.y > 0.0lf ? high.y : low.y, n.z > 0.0lf ? high.z : low.z);
        if (dot(n, support) < -slack) return 0.0lf;
    }
    const dvec3 gap = max(max(low, -high), dvec3(0.0lf));
    return inverse_of(near_squared(dot(gap, gap), slack));
}

double x_over_eye(uint chunk, int column) {
    return origin_quantum.x + eye_spacing.w * (header(chunk, 0u) + double(column) * header(chunk, 4u)) - eye_spacing.x;
}
double y_over_eye(uint chunk, int row) {
    return origin_quantum.y + eye_spacing.w * (header(chunk, 2u) + double(row) * header(chunk, 4u)) - eye_spacing.y;
}
int wrapped(int i) { return i < 0 ? i + 128 : i > 128 ? i - 128 : i; }
// A sample of `owner`, at a column and row of a chunk that may be beyond its sides, relative to the eye
dvec3 point_of(uint chunk, uint owner, int column, int row) {
    const int height = heights[slot_of(owner) * kHeightWords + uint(wrapped(row) * 129 + wrapped(column))];
    return dvec3(x_over_eye(chunk, column), y_over_eye(chunk, row), origin_quantum.z * double(height) - eye_spacing.z);
}
// Over a square of samples that is cut along either diagonal
double ratio_of_square(uint chunk, int west, int south, int side, double bound) {
    dvec3 corners[4];
    corners[0] = point_of(chunk, chunk, west, south);
    corners[1] = point_of(chunk, chunk, west + side, south);
    corners[2] = point_of(chunk, chunk, west + side, south + side);
    corners[3] = point_of(chunk, chunk, west, south + side);
    double most = 0.0lf;
    for (int i = 0; i < 4; ++i)
        most = max(most, ratio_in_view(corners[i + 1 & 3], corners[i + 2 & 3], corners[i + 3 & 3], bound));
    return most;
}

bool is_active_at(uint chunk, int column, int row) { return key_at(chunk, column, row) < threshold(); }

// Whether a triangle is drawn that a given centre would split
bool has_parent(uint chunk, int column, int row, int stride) {
    if (is_root(chunk) && stride > 1) {
        if (stride == 64) return true;
        const int other = ((column / stride + row / stride) / 2 & 1) == 1 ? -stride : stride;
        return is_active_at(chunk, column + stride, row + other) || is_active_at(chunk, column - stride, row - other);
    }
    uint owner = chunk;
    int scale = 2, x = column / 2, y = row / 2;
    const bool is_even = (x + y & 1) == 0;
    if (!is_root(chunk)) {
        owner = parent_of(chunk);
        scale = 1;
        x += is_east_child(chunk) ? 64 : 0;
        y += is_north_child(chunk) ? 64 : 0;
    }
    return is_even ? is_active_at(owner, scale * (x + 1), scale * y) || is_active_at(owner, scale * x, scale * (y + 1))
                   : is_active_at(owner, scale * x, scale * y) || is_active_at(owner, scale * (x + 1), scale * (y + 1));
}

// Of the drawn triangles on both sides of the edge that a midpoint would split
double ratio_of_midpoint(uint chunk, int column, int row, int stride, double bound) {
    const bool along_x = (column / stride & 1) != 0;
    const int to_x = along_x ? 0 : stride, to_y = along_x ? stride : 0;
    const dvec3 begin = point_of(chunk, chunk, column - to_y, row - to_x);
    const dvec3 end = point_of(chunk, chunk, column + to_y, row + to_x);
    double most = 0.0lf;
    for (int side = -1; side <= 1; side += 2) {
        const int x = column + side * to_x, y = row + side * to_y;
        uint owner = chunk;
        if (x < 0) owner = neighbour_of(chunk, kWest);
        if (x > 128) owner = neighbour_of(chunk, kEast);
        if (y < 0) owner = neighbour_of(chunk, kSouth);
        if (y > 128) owner = neighbour_of(chunk, kNorth);
        if (!is_open(owner) || !is_active_at(owner, wrapped(x), wrapped(y))) continue;
        most = max(most, ratio_in_view(begin, end, point_of(chunk, owner, x, y), bound));
    }
    return most;
}

// Morph::error_with_held(), in thresholds
double share_of(double excess) {
    const double inverse = inverse_of(excess);
    return clamp(distances.w * (1.0lf - inverse * inverse), 0.0lf, 1.0lf);
}
double integral_of(double from, double to) {
    const double low = clamp(from, 1.0lf, distances.z), high = clamp(to, 1.0lf, distances.z);
    return 2.0lf * distances.w * max(0.0lf, inverse_of(low) - inverse_of(high));
}

void find_vertex_error(uint chunk, int column, int row, int stride, float inverse_square_bound) {
    const float key = key_at(chunk, column, row);
    const double bound = root_of(inverse_of(double(inverse_square_bound))) * kRoundUp;
    double ratio = 0.0lf;
    if ((column / stride & row / stride & 1) == 0) {
        ratio = ratio_of_midpoint(chunk, column, row, stride, bound);
    } else if (has_parent(chunk, column, row, stride)) {
        ratio = ratio_of_square(chunk, column - stride, row - stride, 2 * stride, bound);
    }
    if (!(key < threshold())) {
        raise(isinf(key) ? kAbsentError : kHeldError, rounded_up(ratio));
        return;
    }
    if (!(ratio > 0.0lf)) return;
    // priorities in thresholds
    const double shown = root_of(double(threshold()) * inverse_of(double(key)));
    const double wanted = root_of(double(threshold()) * ratio) * kRoundUp;
    if (wanted <= shown) return;
    raise(kMorphingError, rounded_up(integral_of(1.0lf, shown) + (share_of(wanted) - share_of(shown)) * wanted +
                                     integral_of(wanted, distances.z)));
}

void main() {
    const uint number = gl_GlobalInvocationID.x;
    if (number >= min(state[kCandidates], last_bases.w)) return;
    const uint at = last_bases.y + kCandidateWords * number;
    const uint chunk = work[at] >> 1, place = work[at + 1u];
    const int column = int(place & 255u), row = int(place >> 8 & 255u), stride = int(place >> 16);
    const float bound = uintBitsToFloat(work[at + 2u]);
    if ((work[at] & 1u) == kCell) {
        raise(level_of(chunk) == options.z ? kFinestError : kAbsentError,
              rounded_up(ratio_of_square(chunk, column, row, 1, double(bound))));
    } else {
        find_vertex_error(chunk, column, row, stride, bound);
    }
}
