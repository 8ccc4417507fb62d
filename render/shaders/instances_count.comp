// Counts the instances of each group by slot.
layout(local_size_x = 32) in;
layout(location = 0) uniform uint group_count;
shared uint members[kSlots];
shared uint drawn;

void main() {
    const uint number = group_index(), i = gl_LocalInvocationID.x;
    if (number >= group_count) return;
    if (i < kSlots) members[i] = 0u;
    if (i == 0u) drawn = 0u;
    barrier();
    const uvec4 group = groups[number];
    if (has_bit(state[kGroupBits + number], i)) {
        const uint model = model_of(group.y);
        const Chosen chosen = choose(model, factors[number * kGroupObjects + i]);
        const vec4 place = place_of(group.x + i, group.y);
        if (chosen.finer != kNone) {
            atomicOr(drawn, 1u << i);
            atomicOr(members[slot_of(model, chosen.finer, place)], 1u << i);
        }
        if (chosen.coarser != kNone) atomicOr(members[slot_of(model, chosen.coarser, place)], 1u << i);
    }
    barrier();
    if (i < kSlots) slots[group_slot(number, i)] = uint(bitCount(members[i]));
    if (i == 0u && drawn != 0u) atomicAdd(state[kDrawn], uint(bitCount(drawn)));
}
