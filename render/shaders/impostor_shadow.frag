// SPDX-License-Identifier: MIT
layout(binding = 0) uniform sampler2DArray colours;  // see impostor.frag

in vec2 at;
flat in float view;
flat in float coverage;

void main() { keep_samples(covered_samples(coverage, texture(colours, vec3(at, view)).a)); }
