// SPDX-License-Identifier: MIT
#include "query/answer_values.h"

namespace terrane::tools {

using Json = nlohmann::ordered_json;

Json as_array(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json as_object(const ShapeFeature& feature) {
    if (feature.second == ShapeFeature::kFace) return {{"face", feature.first}};
    if (feature.second == feature.first) return {{"vertex", feature.first}};
    return {{"edge", Json::array({feature.first, feature.second})}};
}

const char* name_of(GroundStatus status) {
    switch (status) {
        case GroundStatus::ok:
            return "ok";
        case GroundStatus::miss:
            return "miss";
        case GroundStatus::outside:
            return "outside";
        case GroundStatus::not_resident:
            return "not_resident";
        case GroundStatus::invalid:
            break;
    }
    return "invalid";
}

bool write_fault(QueryStatus status, Json& answer) {
    if (status == QueryStatus::not_resident) {
        answer["status"] = "not_resident";
        return true;
    }
    if (status == QueryStatus::invalid) {
        answer["status"] = "invalid";
        answer["message"] = "the shape or its pose was refused";
        return true;
    }
    return false;
}

}  // namespace terrane::tools
