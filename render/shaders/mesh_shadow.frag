// SPDX-License-Identifier: MIT
// Shadow of a mesh: depth only, of the pixels that its coverage keeps.
flat in float coverage;

void main() { keep_samples(covered_samples(coverage, 1.0)); }
