// SPDX-License-Identifier: MIT
#include "page/paging_report.h"

#include "assets.h"

#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

// JSON has no infinity: shows the ratio as text.
nlohmann::ordered_json ratio(const std::optional<double>& value) {
    if (!value) return nullptr;
    if (std::isinf(*value)) return "inf";
    return *value;
}

nlohmann::ordered_json cell_data(const PagingVerdict& verdict, bool is_plotted) {
    nlohmann::ordered_json cell;
    cell["runs"] = nlohmann::ordered_json::object();
    cell["errors"] = nlohmann::ordered_json::object();
    for (const PagingRow* row : {verdict.deadline, verdict.distance, verdict.oracle}) {
        if (row == nullptr) continue;
        const std::string policy = name_of(row->policy);
        const std::vector<FrameRecord>& frames = row->run.frames;
        cell["runs"][policy] = to_json(*row);
        if (!is_plotted || frames.empty()) continue;
        cell["time"] = thinned(frames, [](const FrameRecord& frame) { return frame.time; });
        cell["target"] = frames.front().max_error_px;
        cell["errors"][policy] =
            thinned(frames, [](const FrameRecord& frame) { return frame.error_px; });
    }
    cell["late_ratio"] = ratio(verdict.late_ratio);
    cell["excess_ratio"] = ratio(verdict.excess_ratio);
    cell["missed"] = verdict.missed;
    return cell;
}

}  // namespace

Result<void> write_paging_report(const OutputPlace& place, const ReportHeader& header,
                                 std::span<const PagingRow> rows) {
    const std::vector<PagingVerdict> verdicts = judge(rows);
    nlohmann::ordered_json data;
    data["cells"] = nlohmann::ordered_json::array();
    for (const PagingVerdict& verdict : verdicts) {
        data["cells"].push_back(cell_data(verdict, verdicts.size() <= kMostPlottedCells));
    }
    data["targets"] = {{"late", PagingVerdict::kMostLate},
                       {"excess", PagingVerdict::kMostExcess},
                       {"wasted", PagingVerdict::kMostWasted}};
    return write_report(place, header, std::move(data), assets::paging_js);
}

}  // namespace terrane::tools
