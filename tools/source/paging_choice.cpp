// SPDX-License-Identifier: MIT
#include "source/paging_choice.h"

namespace terrane::tools {

std::vector<std::string> paging_choice_names() {
    return {name_of(PagingChoice::deadline), name_of(PagingChoice::distance),
            name_of(PagingChoice::oracle)};
}

const char* name_of(PagingChoice choice) {
    switch (choice) {
        case PagingChoice::deadline:
            return "deadline";
        case PagingChoice::distance:
            return "distance";
        case PagingChoice::oracle:
            return "oracle";
    }
    return "";
}

PagingPolicy pager_policy(PagingChoice choice) {
    return choice == PagingChoice::distance ? PagingPolicy::distance : PagingPolicy::deadline;
}

}  // namespace terrane::tools
