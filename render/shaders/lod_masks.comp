// Bits of the active vertices of each open area: one group for each area.
layout(local_size_x = 64) in;
shared uint bits[6];

void main() {
    const uint slot = gl_WorkGroupID.x, square = gl_LocalInvocationID.x;
    if (square < 6u) bits[square] = 0u;
    barrier();
    for (uint kind = 0u; kind < 3u; ++kind) {
        if (key_of_area(slot, kind, square) < threshold()) atomicOr(bits[2u * kind + (square >> 5)], 1u << (square & 31u));
    }
    barrier();
    if (square < 6u) work[bases.z + 6u * slot + square] = bits[square];
}
