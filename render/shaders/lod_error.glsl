// Errors of triangles whose refinement is blocked by missing vertices, from above: see terrain/lod/residual_error.cpp. A
// first pass lists the candidates, few of the cells and vertices; a second computes their errors.
const float kRoundUp = 1.0 + 1e-6;
void raise(uint residual, float value) {
    if (value > uintBitsToFloat(state[kResiduals + residual])) atomicMax(state[kResiduals + residual], floatBitsToUint(value));
}
// Squares of bound over distance, rounded up, but for the metres and for the error of morphs, in thresholds
const uint kAbsentError = 0u, kHeldError = 1u, kFinestError = 2u, kFinestMetres = 3u, kMorphingError = 4u;
const uint kAbsentLeast = 5u, kFinestLeast = 6u;  // lower bounds

// A cell or a vertex of a chunk, and its bound: of a cell in metres, of a vertex as inverse square
const uint kCell = 0u, kVertex = 1u;
const uint kCandidateWords = 3u, kErrorGroupSize = 32u;
// False if the list is full
bool add_candidate(uint kind, uint chunk, int column, int row, int stride, float bound) {
    const uint number = atomicAdd(state[kCandidates], 1u);
    if (number >= last_bases.w) return false;
    const uint at = last_bases.y + kCandidateWords * number;
    work[at] = chunk << 1 | kind;
    work[at + 1u] = uint(column) | uint(row) << 8 | uint(stride) << 16;
    work[at + 2u] = floatBitsToUint(bound);
    atomicMax(state[kErrorGroups], number / kErrorGroupSize + 1u);
    return true;
}
float least_squared() {
    const float least = max(float(origin_quantum.w), float(distances.x));
    return least * least;
}

// The key of the vertex at a sample of a chunk: OpenChunk::key_at()
float key_at(uint chunk, int column, int row) {
    if (((column | row) & 1) == 0) return is_root(chunk) ? coarse_key(chunk, uint(column) / 2u, uint(row) / 2u) : kNever;
    uint owner = chunk;
    if (column == 128) {
        if (is_at_border(chunk, kEast)) return side_key(chunk, kEast, uint(row) / 2u);
        owner = neighbour_of(chunk, kEast);
    } else if (row == 128) {
        if (is_at_border(chunk, kNorth)) return side_key(chunk, kNorth, uint(column) / 2u);
        owner = neighbour_of(chunk, kNorth);
    }
    if (!is_open(owner)) return kNever;
    const int c = column & 127, r = row & 127;
    const uint slot = slot_of_area(owner, uint(r / 16 * 8 + c / 16));
    const uint kind = (r & 1) == 0 ? kAlongX : (c & 1) == 0 ? kAlongY : kCentre;
    return slot == kNone ? kNever : key_of_area(slot, kind, uint(r % 16 / 2 * 8 + c % 16 / 2));
}

// Lists a vertex if it is held. `own` is its key before it was raised to the parents' keys.
void visit_vertex(uint chunk, int column, int row, int stride, float own, float inverse_square_bound) {
    if (!(own < threshold())) return;
    const float key = key_at(chunk, column, row);
    precise float nested = own * kNestMargin;
    // a little less than what is displayed in place
    const float in_place = threshold() / float(distances.z * distances.z) * (1.0 - 1e-6);
    if (!(nested < key) || key < in_place || (key < threshold() && options.y == 0u)) return;
    if (add_candidate(kVertex, chunk, column, row, stride, inverse_square_bound)) return;
    // as if it were at the eye: an upper bound, which is not exact
    const float ratio = 1.0001 / (inverse_square_bound * least_squared());
    if (key < threshold()) {
        raise(kMorphingError, 2.0 + sqrt(threshold() * ratio));
    } else {
        raise(isinf(key) ? kAbsentError : kHeldError, ratio);
    }
}
