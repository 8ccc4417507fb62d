// SPDX-License-Identifier: MIT
#include "broadphase/pair_list.h"

#include <algorithm>

namespace terrane::internal {

void PairList::sort(std::size_t body_count) {
    first_.assign(body_count + 1, 0);
    for (const BodyPair& pair : found_) ++first_[pair.a + 1];
    for (std::size_t i = 1; i <= body_count; ++i) first_[i] += first_[i - 1];
    sorted_.resize(found_.size());
    for (const BodyPair& pair : found_) sorted_[first_[pair.a]++] = pair;
    // Now first_[i] is where the pairs of body i end.
    std::size_t begin = 0;
    while (begin < sorted_.size()) {
        const std::size_t end = first_[sorted_[begin].a];
        std::sort(sorted_.begin() + static_cast<std::ptrdiff_t>(begin),
                  sorted_.begin() + static_cast<std::ptrdiff_t>(end),
                  [](const BodyPair& x, const BodyPair& y) { return x.b < y.b; });
        begin = end;
    }
}

}  // namespace terrane::internal
