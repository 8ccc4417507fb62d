// SPDX-License-Identifier: MIT
// Heights only: the same seed gives the same ground.
#include <terrane/terrain/fractal_heights.h>

#include <cstdio>

int main() {
    const auto one = terrane::FractalHeights::create({.seed = 7});
    const auto other = terrane::FractalHeights::create({.seed = 7});
    if (!one || !other) {
        std::printf("no ground: %s\n", (one ? other : one).error().message.c_str());
        return 1;
    }
    const double height = (*one)->height(1234.5, -678.9);
    std::printf("height %.6f m\n", height);
    return height == (*other)->height(1234.5, -678.9) ? 0 : 1;
}
