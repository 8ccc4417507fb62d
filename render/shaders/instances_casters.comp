// Copies the instances on the device that can cast a shadow into a map: see SunCascade::meets(). A row of groups of
// invocations for each selection.
#version 450 core
layout(local_size_x = 64) in;

struct Selection {
    uvec4 range;      // first instance, their number, first copy, word of the count in commands[]
    vec4 right, up, sun;  // axes of the map; the centre from the eye, along them
    vec4 sizes;       // half side of the map, radius of the object at scale 1, what an instance adds to the count
};
layout(std430, binding = 0) readonly buffer Selections { Selection selections[]; };
layout(std430, binding = 1) readonly buffer Instances { vec4 instances[]; };
layout(std430, binding = 2) writeonly buffer Copies { vec4 copies[]; };
layout(std430, binding = 3) coherent buffer Commands { uint commands[]; };

void main() {
    const Selection selection = selections[gl_WorkGroupID.y];
    if (gl_GlobalInvocationID.x >= selection.range.y) return;
    const uint from = 3u * (selection.range.x + gl_GlobalInvocationID.x);
    const vec4 place = instances[from];
    const vec3 along = vec3(dot(selection.right.xyz, place.xyz) - selection.right.w,
                            dot(selection.up.xyz, place.xyz) - selection.up.w,
                            dot(selection.sun.xyz, place.xyz) - selection.sun.w);
    // more than the rounding
    const float margin = 1e-5 * (length(place.xyz) + abs(selection.right.w) + abs(selection.up.w) + abs(selection.sun.w));
    const float limit = selection.sizes.x + place.w * selection.sizes.y + margin;
    if (abs(along.x) > limit || abs(along.y) > limit || along.z < -limit) return;
    const uint step = uint(selection.sizes.z);
    const uint to = 3u * (selection.range.z + atomicAdd(commands[selection.range.w], step) / step);
    for (uint i = 0u; i < 3u; ++i) copies[to + i] = instances[from + i];
}
