// SPDX-License-Identifier: MIT
#include "simplify/contractor.h"
#include "simplify/input_checks.h"

#include <terrane/terrain/simplify.h>

namespace terrane {

Result<std::vector<SimplifiedMesh>> simplify(const SimplifyInput& input,
                                             std::span<const SimplifyLevel> levels) {
    if (auto ok = internal::check_simplify_input(input, levels); !ok)
        return tl::unexpected<Error>(ok.error());
    std::vector<SimplifiedMesh> result;
    result.reserve(levels.size());
    if (levels.empty()) return result;
    internal::Contractor contractor(input);
    for (const SimplifyLevel& level : levels) {
        const SimplifyStop stop = contractor.contract_to(level);
        result.push_back(contractor.result());
        result.back().stop = stop;
    }
    return result;
}

}  // namespace terrane
