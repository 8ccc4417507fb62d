// Opens the areas that may have a vertex below the floor: one group for each resident chunk. A few more than the CPU
// opens, because the bound is rounded outward here; keys above the floor do not change the mesh.
layout(local_size_x = 64) in;
shared uint mask[2];

bool may_be_below(uint chunk, uint area) {
    const float bound = uintBitsToFloat(vertices[vertex_words(chunk) + kBoundsWord + area]);
    const uint reach = vertices[vertex_words(chunk) + kReachesWord + area];
    const float unit = reach_unit(chunk), base = reach_base(chunk), width = centre_width(chunk);
    const uint west = (area & 7u) * 16u, south = (area >> 3) * 16u;
    vec3 low = vec3(position_over_eye(chunk, 0u, west) - width, position_over_eye(chunk, 1u, south) - width,
                    over_eye(bitfieldExtract(int(reach), 0, 16), unit, base));
    vec3 high = vec3(position_over_eye(chunk, 0u, west + 16u) + width, position_over_eye(chunk, 1u, south + 16u) + width,
                     over_eye(bitfieldExtract(int(reach), 16, 16), unit, base));
    const vec3 most = max(abs(low), abs(high));
    const float slack = 1e-5 * (most.x + most.y + most.z);
    low -= slack;
    high += slack;
    const vec3 gap = max(max(low, -high), vec3(0.0));
    const float distance_squared = max(dot(gap, gap), scalars.x);
    const float far = most.x + most.y + most.z + scalars.y;
    float beside = 0.0;
    for (int i = 0; i < 4; ++i) {
        const vec3 n = planes[i].xyz;
        const vec3 support = vec3(n.x > 0.0 ? high.x : low.x, n.y > 0.0 ? high.y : low.y, n.z > 0.0 ? high.z : low.z);
        beside = max(beside, -dot(n, support));
    }
    const float weight = max(1.0 - kWeightSlope * beside / far, kLeastWeight) * 1.0001;
    const float weighed = bound * weight;
    // bound 0: infinite keys
    return weighed > 0.0 && 0.999 * distance_squared / weighed < scalars.z * weighed;
}

// Whether a pin below the floor is within reach of an area's vertices: SolidPins::opens()
bool is_area_pinned(uint chunk, uint area) {
    if (!is_pinned(chunk)) return false;
    const double step = header(chunk, 4u);
    const dvec2 corner = dvec2(header(chunk, 0u), header(chunk, 2u)) + 16.0lf * step * dvec2(double(area & 7u), double(area >> 3));
    return least_pin_key(dvec4(corner - 3.0lf * step, corner + 19.0lf * step), scalars.z) < scalars.z;
}

void main() {
    const uint chunk = gl_WorkGroupID.x, area = gl_LocalInvocationID.x;
    if (area < 2u) mask[area] = 0u;
    barrier();
    bool is_chunk_open = true;
    for (uint above = chunk; above != kNone; above = parent_of(above))
        is_chunk_open = is_chunk_open && (least_key(above) < scalars.z || is_pinned(above));
    if (is_chunk_open && (is_root(chunk) || may_be_below(chunk, area) || is_area_pinned(chunk, area)))
        atomicOr(mask[area >> 5], 1u << (area & 31u));
    keys[more_bases.x + chunk * 128u + area] = kNever;
    keys[more_bases.x + chunk * 128u + 64u + area] = kNever;
    barrier();
    if (area != 0u) return;
    work[3u * chunk] = mask[0];
    work[3u * chunk + 1u] = mask[1];
    work[3u * chunk + 2u] = is_chunk_open ? 0u : kNone;
}
