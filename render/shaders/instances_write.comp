// Writes the instances of each group. The large ones of an impostor are written from the end of its range, as SceneObjects
// sorts them.
layout(local_size_x = 32) in;
layout(location = 0) uniform uint group_count;
shared uint members[kSlots];

void write(uint number, uvec4 group, vec4 place, uint level, uint slot, float coverage) {
    const uint i = gl_LocalInvocationID.x, model = model_of(group.y), object = group.x + i;
    const uint rank = slots[group_slot(number, slot)] + uint(bitCount(members[slot] & ((1u << i) - 1u)));
    const uint first = slots[model * kMostLevels + level];
    uint at = first + rank;
    if ((slot & 1u) != 0u) {
        const uint all = slots[slot_count(model, slot - 1u)] + slots[slot_count(model, slot)];
        at = first + all - 1u - rank;
    }
    instances[3u * at] = place;
    instances[3u * at + 1u] = objects[4u * object + 2u];
    instances[3u * at + 2u] = vec4(coverage, objects[4u * object + 3u].yzw);
}

void main() {
    const uint number = group_index(), i = gl_LocalInvocationID.x;
    if (number >= group_count) return;
    if (i < kSlots) members[i] = 0u;
    barrier();
    const uvec4 group = groups[number];
    const bool is_taken = has_bit(state[kGroupBits + number], i);
    Chosen chosen = Chosen(kNone, kNone, 1.0);
    vec4 place = vec4(0.0);
    uint finer = 0u, coarser = 0u;
    if (is_taken) {
        const uint model = model_of(group.y);
        chosen = choose(model, factors[number * kGroupObjects + i]);
        place = place_of(group.x + i, group.y);
        if (chosen.finer != kNone) {
            finer = slot_of(model, chosen.finer, place);
            atomicOr(members[finer], 1u << i);
        }
        if (chosen.coarser != kNone) {
            coarser = slot_of(model, chosen.coarser, place);
            atomicOr(members[coarser], 1u << i);
        }
    }
    barrier();
    if (chosen.finer != kNone) write(number, group, place, chosen.finer, finer, chosen.share);
    if (chosen.coarser != kNone) {
        precise float rest = chosen.share - 1.0;
        write(number, group, place, chosen.coarser, coarser, rest);
    }
}
