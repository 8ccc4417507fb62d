// Sums the counts of a slot of a model over the groups before each. A group of invocations for each slot.
layout(local_size_x = 256) in;
shared uint sums[256];

void main() {
    const uint i = gl_LocalInvocationID.x, model = group_index() / kSlots, slot = group_index() % kSlots;
    if (model >= counts.x) return;
    const uint end = model_word(model, kEndGroup);
    uint carried = 0u;
    for (uint first = model_word(model, kFirstGroup); first < end; first += 256u) {
        const uint group = first + i;
        const uint own = group < end ? slots[group_slot(group, slot)] : 0u;
        sums[i] = own;
        barrier();
        for (uint step = 1u; step < 256u; step <<= 1) {
            const uint before = i >= step ? sums[i - step] : 0u;
            barrier();
            sums[i] += before;
            barrier();
        }
        if (group < end) slots[group_slot(group, slot)] = carried + sums[i] - own;
        carried += sums[255];
        barrier();
    }
    if (i == 0u) slots[slot_count(model, slot)] = carried;
}
