// SPDX-License-Identifier: MIT
#include "flight/paging_choice.h"

namespace terrane::tools {

std::optional<PagingChoice> parse_paging_choice(std::string_view name) {
    for (const PagingChoice choice :
         {PagingChoice::deadline, PagingChoice::distance, PagingChoice::oracle}) {
        if (name == name_of(choice)) return choice;
    }
    return std::nullopt;
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
