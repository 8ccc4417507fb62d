// Finds the objects of groups that are in view and drawn at the least threshold, their factors, and the counts of these: see
// FrameObjects and FactorCounts. A group of objects in a group of invocations.
layout(local_size_x = 32) in;

const int kBinsPerOctave = 64, kFirstOctave = -30, kOctaves = 60;
const uint kBins = uint(kOctaves * kBinsPerOctave + 2);

layout(location = 0) uniform uint group_count;

shared uint taken, left_out, occluded;

// ViewVolume::test_planes() of a sphere
bool is_in_view(dvec3 centre, double radius, uint planes) {
    precise double margin = 1e-14lf * (abs(centre.x) + abs(centre.y) + abs(centre.z) + radius + eye_far.w);
    precise double reach = radius + margin;
    for (uint plane = 0u; plane < counts.y; ++plane) {
        if (!has_bit(planes, plane)) continue;
        const dvec3 n = normals[plane].xyz;
        precise double at = n.x * centre.x + n.y * centre.y + n.z * centre.z;
        if (plane == 4u) at = at + eye_far.w;
        if (!(at >= -reach)) return false;
    }
    return true;
}

float factor_of(vec4 sphere, float log_scale, vec3 origin) {
    precise vec3 d = sphere.xyz + origin;
    precise float squared = d.x * d.x + d.y * d.y + d.z * d.z;
    precise float distance = root_of(squared) - sphere.w;
    precise float sum = scalars.y + log_scale;
    precise float factor = sum - log2_of(max(distance, scalars.x));
    return factor;
}

uint bin_of(float factor) {
    precise float at = (factor - float(kFirstOctave)) * float(kBinsPerOctave);
    if (!(at >= 0.0)) return 0u;
    return at < float(kOctaves * kBinsPerOctave) ? uint(at) + 1u : kBins - 1u;
}

void main() {
    const uint number = group_index(), i = gl_LocalInvocationID.x;
    if (number >= group_count) return;
    if (i == 0u) taken = left_out = occluded = 0u;
    barrier();
    const uvec4 group = groups[number];
    if (i < count_of(group)) {
        const uint object = group.x + i, cluster = group.y, model = model_of(cluster);
        const vec4 sphere = objects[4u * object];
        const dvec3 origin = dvec3(cluster_double(cluster, 0u), cluster_double(cluster, 1u), cluster_double(cluster, 2u));
        precise dvec3 centre_world = origin + dvec3(sphere.xyz);
        precise dvec3 centre = centre_world - eye_far.xyz;
        const uint planes = planes_of(group);
        if (planes == 0u || is_in_view(centre, double(sphere.w), planes)) {
            const float factor = factor_of(sphere, objects[4u * object + 3u].x, origin_eye(cluster));
            const uint last = model_word(model, kLast);
            precise float most = log2_error(model, last) + uintBitsToFloat(model_word(model, kRatio)) + factor;
            if (!(most > scalars.z)) {
                atomicOr(left_out, 1u << i);
            } else if (has_bit(group.w, i)) {
                atomicOr(occluded, 1u << i);
            } else {
                atomicOr(taken, 1u << i);
                factors[number * kGroupObjects + i] = factor;
                atomicAdd(slots[model * kBins + bin_of(factor)], 1u);
            }
        }
    }
    barrier();
    if (i != 0u) return;
    state[kGroupBits + number] = taken;
    if (taken != 0u) atomicAdd(state[kTaken], uint(bitCount(taken)));
    if (left_out != 0u) atomicAdd(state[kLeftOut], uint(bitCount(left_out)));
    if (occluded != 0u) atomicAdd(state[kOccluded], uint(bitCount(occluded)));
}
