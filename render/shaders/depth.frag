// SPDX-License-Identifier: MIT
// The ground's first pass: only depth is written. shade.frag colours it.

void main() {}
