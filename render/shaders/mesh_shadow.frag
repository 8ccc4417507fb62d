// SPDX-License-Identifier: MIT
// Shadow of a mesh: depth only, for the pixels kept by its coverage and, with TEXTURED, by the cut of its texture.
flat in float coverage;

void main() {
#ifdef TEXTURED
    keep_samples(covered_samples(coverage, opacity_of(albedo_here().a)));
#else
    keep_samples(covered_samples(coverage, 1.0));
#endif
}
