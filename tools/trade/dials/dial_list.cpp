// SPDX-License-Identifier: MIT
#include "trade/dials/dial_list.h"

#include <iterator>

namespace terrane::tools {

std::vector<Dial> all_dials() {
    std::vector<Dial> all;
    for (const auto& make : {pixel_dials, contact_dials, step_dials, paging_dials, measure_dials,
                             number_dials, hull_dials, object_dials, crowd_dials}) {
        std::vector<Dial> dials = make();
        all.insert(all.end(), std::make_move_iterator(dials.begin()),
                   std::make_move_iterator(dials.end()));
    }
    return all;
}

std::vector<std::string> dial_names() {
    std::vector<std::string> names;
    for (const Dial& dial : all_dials()) names.push_back(dial.key);
    return names;
}

}  // namespace terrane::tools
