// Squares and number of triangles of each open area: one group for each area.
layout(local_size_x = 64) in;
shared uint total;

void main() {
    const Area a = area_at(gl_WorkGroupID.x);
    const uint square = gl_LocalInvocationID.x;
    if (square == 0u) total = 0u;
    barrier();
    const uint word = bit_of(a.slot, kCentre, square) ? word_of(a, square) : kNone;
    work[last_bases.x + 64u * a.slot + square] = word;
    if (word != kNone) atomicAdd(total, triangles_of(word));
    barrier();
    if (square == 0u) work[bases.w + a.slot] = total;
}
