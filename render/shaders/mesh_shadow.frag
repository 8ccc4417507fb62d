// SPDX-License-Identifier: MIT
// Shadow of a mesh: depth only, for the pixels kept by its coverage.
flat in float coverage;

void main() { keep_samples(covered_samples(coverage, 1.0)); }
