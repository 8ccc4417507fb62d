// Results of the operations on which equal bits depend: one probe in each invocation. See probe_arithmetic().
#version 450 core
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Probes { uvec4 probes[]; };  // three floats; a word
layout(std430, binding = 1) buffer Results { uint results[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    const float a = uintBitsToFloat(probes[i].x), b = uintBitsToFloat(probes[i].y), c = uintBitsToFloat(probes[i].z);
    precise float product = a * b;
    precise float sum = a + b;
    precise float difference = a - b;
    precise float product_and_sum = a * b + c;  // two roundings
    // doubles with all bits in use
    precise double x = double(a) + double(b) * 0.1lf, y = double(c) - double(b) * 0.3lf;
    precise double double_product = x * y;
    precise double double_sum = x + y;
    const uvec2 product_bits = unpackDouble2x32(double_product), sum_bits = unpackDouble2x32(double_sum);
    const uint to = 10u * i;
    results[to] = floatBitsToUint(product);
    results[to + 1u] = floatBitsToUint(sum);
    results[to + 2u] = floatBitsToUint(difference);
    results[to + 3u] = floatBitsToUint(product_and_sum);
    results[to + 4u] = product_bits.x;
    results[to + 5u] = product_bits.y;
    results[to + 6u] = sum_bits.x;
    results[to + 7u] = sum_bits.y;
    results[to + 8u] = floatBitsToUint(float(double_sum));
    results[to + 9u] = floatBitsToUint(float(int(probes[i].w)));
}
