// SPDX-License-Identifier: MIT
#include "crowd/study/study_report.h"

#include "assets.h"

#include <utility>

namespace terrane::tools {

Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables) {
    nlohmann::ordered_json data;
    data["tables"] = nlohmann::ordered_json::array();
    for (const StudyTable& table : tables) data["tables"].push_back(to_json(table));
    return write_report(place, header, std::move(data), assets::study_js);
}

}  // namespace terrane::tools
