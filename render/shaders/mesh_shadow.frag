// SPDX-License-Identifier: MIT
// Shadow of a mesh: depth alone, of the share that is there.
flat in float coverage;

void main() { keep_samples(covered_samples(coverage, 1.0)); }
