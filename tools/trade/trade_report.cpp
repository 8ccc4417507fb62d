// SPDX-License-Identifier: MIT
#include "trade/trade_report.h"

#include "assets.h"

#include <utility>

namespace terrane::tools {

Result<void> write_trade_report(const OutputPlace& place, const ReportHeader& header,
                                const std::vector<nlohmann::ordered_json>& documents) {
    nlohmann::ordered_json data;
    data["documents"] = documents;
    return write_report(place, header, std::move(data), assets::trade_js);
}

}  // namespace terrane::tools
