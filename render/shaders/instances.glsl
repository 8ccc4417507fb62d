// Buffers and helpers of the compute shaders that cull instances and choose their levels: see gpu_instances.cpp. They repeat
// terrane::scene's FrameObjects and LevelChoice with the same bits: floats are `precise`, and quotients and roots are rounded
// correctly.
#version 450 core

layout(std140, binding = 0) uniform Frame {
    dvec4 eye_far;     // the eye, world; distance of the far plane, 0: none
    dvec4 normals[5];  // inward, of the view's planes
    vec4 scalars;      // near distance; logarithms of pixels per radian, of the least threshold, of the threshold
    uvec4 counts;      // models, planes
};

layout(std430, binding = 0) readonly buffer Objects { vec4 objects[]; };
layout(std430, binding = 1) readonly buffer Clusters { uint clusters[]; };
layout(std430, binding = 2) readonly buffer Groups { uvec4 groups[]; };
layout(std430, binding = 3) readonly buffer Models { uint models[]; };
layout(std430, binding = 4) coherent buffer Factors { float factors[]; };
layout(std430, binding = 5) coherent buffer State { uint state[]; };
layout(std430, binding = 6) coherent buffer Slots { uint slots[]; };
layout(std430, binding = 7) writeonly buffer Instances { vec4 instances[]; };

const uint kGroupObjects = 32u;
const uint kNone = 0xffffffffu;

// Words of state[], before the bits of the taken objects of each group
const uint kTaken = 0u, kLeftOut = 1u, kOccluded = 2u, kDrawn = 3u, kGroupBits = 4u;

// Words of a model in models[]
const uint kModelWords = 32u, kMostLevels = 8u;
const uint kLast = 0u, kRatio = 1u, kFirstGroup = 2u, kEndGroup = 3u, kErrors = 4u, kMorphs = 13u, kImpostors = 14u, kSmall = 16u;

// A level has two slots: of small instances of an impostor or all of a mesh, and of large ones of an impostor. slots[] has
// the first instance of each level, the counts of each slot, the counts of each group, summed over the groups before it.
const uint kSlots = 2u * kMostLevels;
uint slot_count(uint model, uint slot) { return counts.x * kMostLevels + model * kSlots + slot; }
uint group_slot(uint group, uint slot) { return counts.x * (kMostLevels + kSlots) + group * kSlots + slot; }

uint model_word(uint model, uint word) { return models[model * kModelWords + word]; }
float log2_error(uint model, uint level) { return uintBitsToFloat(model_word(model, kErrors + level)); }
bool has_bit(uint word, uint bit) { return (word >> bit & 1u) != 0u; }

// Ten words of a cluster: origin, world, as doubles; origin minus the eye; model
const uint kClusterWords = 10u;
double cluster_double(uint cluster, uint axis) {
    const uint at = cluster * kClusterWords + 2u * axis;
    return packDouble2x32(uvec2(clusters[at], clusters[at + 1u]));
}
vec3 origin_eye(uint cluster) {
    const uint at = cluster * kClusterWords + 6u;
    return uintBitsToFloat(uvec3(clusters[at], clusters[at + 1u], clusters[at + 2u]));
}
uint model_of(uint cluster) { return clusters[cluster * kClusterWords + 9u]; }

// A group in view: its first object, its cluster, the number of objects and the planes to be tested, the hidden objects
uint group_index() { return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x; }
uint count_of(uvec4 group) { return group.z & 0xffu; }
uint planes_of(uvec4 group) { return group.z >> 8; }

// The float nearest to a quotient of positive floats that is normal. The middle of two floats, times a float, is exact in
// double precision.
float quotient_of(float a, float b) {
    uint bits = floatBitsToUint(a / b);
    for (int step = 0; step < 8; ++step) {
        precise double q = double(uintBitsToFloat(bits));
        precise double above = 0.5lf * (q + double(uintBitsToFloat(bits + 1u))) * double(b);
        precise double below = 0.5lf * (q + double(uintBitsToFloat(bits - 1u))) * double(b);
        const uint next = double(a) > above ? bits + 1u : double(a) < below ? bits - 1u : bits;
        if (next == bits) break;
        bits = next;
    }
    return uintBitsToFloat(bits);
}
// The float nearest to a root that is normal; 0 for less.
float root_of(float x) {
    if (!(x >= 1.2e-38)) return 0.0;
    uint bits = floatBitsToUint(sqrt(x));
    for (int step = 0; step < 8; ++step) {
        precise double root = double(uintBitsToFloat(bits));
        precise double above = 0.5lf * (root + double(uintBitsToFloat(bits + 1u)));
        precise double below = 0.5lf * (root + double(uintBitsToFloat(bits - 1u)));
        precise double above_squared = above * above;
        precise double below_squared = below * below;
        const uint next = double(x) > above_squared ? bits + 1u : double(x) < below_squared ? bits - 1u : bits;
        if (next == bits) break;
        bits = next;
    }
    return uintBitsToFloat(bits);
}

// log_scale.h
float log2_of(float x) {
    const uint shifted = floatBitsToUint(x) - 0x3f3504f3u;
    const int exponent = int(shifted) >> 23;
    precise float m = uintBitsToFloat((shifted & 0x007fffffu) + 0x3f3504f3u);
    precise float above = m - 1.0;
    precise float sum = m + 1.0;
    precise float size = above == 0.0 ? 0.0 : quotient_of(abs(above), sum);
    precise float s = above < 0.0 ? -size : size;
    precise float s2 = s * s;
    precise float series = s * (2.88539008 + s2 * (0.961796694 + s2 * (0.577078016 + s2 * 0.412198583)));
    precise float result = float(exponent) + series;
    return result;
}

// LevelChoice::choose(); coverages of the finer and the coarser level
struct Chosen {
    uint finer, coarser;
    float share;
};
Chosen choose(uint model, float factor) {
    const uint last = model_word(model, kLast);
    precise float most = scalars.w - factor;
    uint level = 0u;
    for (uint i = last; i > 0u; --i) {
        if (!(log2_error(model, i) > most)) {
            level = i;
            break;
        }
    }
    const uint itself = level == last ? kNone : level;
    const float ratio = uintBitsToFloat(model_word(model, kRatio));
    precise float over = log2_error(model, level) + ratio - most;
    if (level == 0u || !(over > 0.0)) return Chosen(itself, kNone, 1.0);
    // a quotient below 2^-11, which may not be normal, is raised like 0
    precise float share = over < ratio * 0.00048828125 ? 0.0 : quotient_of(over, ratio);
    share = min(max(share, 0.0009765625), 0.9990234375);
    if (has_bit(model_word(model, kMorphs), level - 1u)) {
        precise float morph = 2.0 - share;
        return Chosen(level - 1u, kNone, morph);
    }
    return Chosen(level - 1u, itself, share);
}

// The slot of an instance in a level. SceneObjects draws small impostors apart.
uint slot_of(uint model, uint level, vec4 place) {
    if (!has_bit(model_word(model, kImpostors), level)) return 2u * level;
    const float most_squared = uintBitsToFloat(model_word(model, kSmall + level));
    precise float scale_squared = place.w * place.w;
    precise float limit = most_squared * (place.x * place.x + place.y * place.y + place.z * place.z);
    return scale_squared <= limit ? 2u * level : 2u * level + 1u;
}

// Offset from the eye and scale of an object
vec4 place_of(uint object, uint cluster) {
    const vec4 place = objects[4u * object + 1u];
    precise vec3 offset = place.xyz + origin_eye(cluster);
    return vec4(offset, place.w);
}
