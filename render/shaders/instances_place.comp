// The first instance of each level, in the order of models and levels. One invocation.
layout(local_size_x = 1) in;

void main() {
    uint first = 0u;
    for (uint at = 0u; at < counts.x * kMostLevels; ++at) {
        slots[at] = first;
        first += slots[slot_count(0u, 2u * at)] + slots[slot_count(0u, 2u * at + 1u)];
    }
}
