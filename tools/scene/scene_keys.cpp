// SPDX-License-Identifier: MIT
#include "scene/scene_keys.h"

#include "options/spelling.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Refuses keys that read_shape() would ignore. What has no known kind is left to it.
Parsed<void> check_part_keys(const Json& part, const std::string& path) {
    if (const Parsed<void> good = check_keys(part, path, {"shape", "position", "rotation"});
        !good) {
        return good;
    }
    const auto shape = part.find("shape");
    return shape == part.end() ? Parsed<void>{} : check_shape_keys(*shape, path + ".shape");
}

}  // namespace

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

Parsed<void> check_shape_keys(const Json& shape, const std::string& path) {
    if (!shape.is_object() || shape.size() != 1) return {};
    const std::string& kind = shape.begin().key();
    const Json& content = shape.begin().value();
    const std::string inner = path + "." + kind;
    if (kind == "compound" && content.is_array()) {
        for (std::size_t i = 0; i < content.size(); ++i) {
            const Parsed<void> good = check_part_keys(content[i], fmt::format("{}[{}]", inner, i));
            if (!good) return good;
        }
    }
    if (!content.is_object()) return {};
    if (kind == "sphere") return check_keys(content, inner, {"radius"});
    if (kind == "capsule") return check_keys(content, inner, {"radius", "half_height"});
    if (kind == "box") return check_keys(content, inner, {"half_extents"});
    if (kind == "hull") return check_keys(content, inner, {"points"});
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
