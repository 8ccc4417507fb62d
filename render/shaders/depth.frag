// SPDX-License-Identifier: MIT
// Depth-only pass of the ground; shade.frag colours it.

void main() {}
