// SPDX-License-Identifier: MIT
#include "query/lonlat_keys.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <variant>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKey = "lonlat";
constexpr const char* kPoints[] = {"from", "to", "eye", "look"};

}  // namespace

Parsed<WorldPos> LonlatKeys::place(const Json& object, const std::string& key, std::size_t count) {
    const Json& value = object.at(key);
    bool is_good = value.is_array() && value.size() == count;
    for (std::size_t i = 0; is_good && i < count; ++i) is_good = value[i].is_number();
    if (!is_good) {
        return wrong(fmt::format("{} must be [longitude, latitude{}], got {}", key,
                                 count == 3 ? ", z" : "", shown(value)));
    }
    if (!georeference_) georeference_ = georeference_of(terrain_);
    if (!*georeference_) {
        return wrong(
            fmt::format("{} needs a raster with a CRS: {}", key, georeference_->error().message));
    }
    WorldPos p_world = (*georeference_)
                           ->world_from_lonlat(Eigen::Vector3d(value[0].get<double>(),
                                                               value[1].get<double>(), 0.0));
    if (!p_world.head<2>().allFinite()) {
        return wrong(fmt::format("{} {} has no place in the raster's CRS", key, shown(value)));
    }
    p_world.z() = count == 3 ? value[2].get<double>() : 0.0;
    return p_world;
}

Parsed<bool> LonlatKeys::replace_in(Json& object) {
    bool has_any = false;
    const auto put = [&](const std::string& from, const char* to) -> Parsed<void> {
        if (!object.contains(from)) return {};
        if (object.contains(to))
            return wrong(fmt::format("{} and {} exclude each other", from, to));
        const Parsed<WorldPos> p_world = place(object, from, 3);
        if (!p_world) return wrong(p_world.error());
        object[to] = Json::array({p_world->x(), p_world->y(), p_world->z()});
        has_any = true;
        return {};
    };
    for (const char* key : kPoints) {
        if (const auto done = put(std::string(key) + "_lonlat", key); !done)
            return wrong(done.error());
    }
    if (const auto found = object.find(kKey); found != object.end() && !found->is_boolean()) {
        const bool is_flat =
            object.contains("op") && (object["op"] == "height" || object["op"] == "height_below");
        if (!is_flat) {
            if (const auto done = put(kKey, "position"); !done) return wrong(done.error());
            return true;
        }
        if (object.contains("x") || object.contains("y")) {
            return wrong("lonlat and x, y exclude each other");
        }
        const Parsed<WorldPos> p_world = place(object, kKey, 2);
        if (!p_world) return wrong(p_world.error());
        object["x"] = p_world->x();
        object["y"] = p_world->y();
        has_any = true;
    }
    return has_any;
}

Parsed<bool> LonlatKeys::replace(Json& question) {
    const auto asked = question.find(kKey);
    bool is_asked = asked != question.end() && asked->is_boolean() && asked->get<bool>();
    if (is_asked) {
        if (!georeference_) georeference_ = georeference_of(terrain_);
        if (!*georeference_) {
            return wrong("lonlat needs a raster with a CRS: " + georeference_->error().message);
        }
    }
    const Parsed<bool> has_any = replace_in(question);
    if (!has_any) return has_any;
    const auto other = question.find("other");
    if (other == question.end() || !other->is_object()) return is_asked || *has_any;
    const Parsed<bool> has_other = replace_in(*other);
    if (!has_other) return wrong("other: " + has_other.error());
    return is_asked || *has_any || *has_other;
}

void LonlatKeys::add_to(Json& answer, const Question& question) const {
    if (!georeference_ || !*georeference_) return;
    WorldPos p_world;
    if (const auto* height = std::get_if<HeightQuestion>(&question)) {
        p_world = {height->x, height->y, 0.0};
    } else if (const auto point = answer.find("point"); point != answer.end()) {
        p_world = {(*point)[0].get<double>(), (*point)[1].get<double>(), (*point)[2].get<double>()};
    } else {
        return;
    }
    const Eigen::Vector3d lonlat = (*georeference_)->lonlat_from_world(p_world);
    answer[kKey] = Json::array({lonlat.x(), lonlat.y()});
}

}  // namespace terrane::tools
