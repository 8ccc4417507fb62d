// SPDX-License-Identifier: MIT
#include "scene/scene_keys.h"

#include "options/spelling.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace terrane::tools {

Parsed<void> check_keys(const nlohmann::ordered_json& value, const std::string& path,
                        std::initializer_list<std::string_view> known) {
    if (!value.is_object()) {
        return wrong(fmt::format("{} must be an object, got {}", path, shown(value)));
    }
    for (const auto& item : value.items()) {
        if (std::ranges::find(known, item.key()) != known.end()) continue;
        const std::vector<std::string> words(known.begin(), known.end());
        return wrong(fmt::format("unknown key '{}.{}'{}", path, item.key(),
                                 did_you_mean(item.key(), words)));
    }
    return {};
}

Parsed<double> read_in_range(const nlohmann::ordered_json& object, const char* key,
                             double otherwise, double low, double high) {
    if (!object.contains(key)) return otherwise;
    const Parsed<double> value = read_number(object, key);
    if (value && !(*value >= low && *value <= high)) {
        return wrong(
            fmt::format("{} must be {:.6g} to {:.6g}, got {:.6g}", key, low, high, *value));
    }
    return value;
}

}  // namespace terrane::tools
