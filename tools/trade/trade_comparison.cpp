// SPDX-License-Identifier: MIT
#include "trade/trade_comparison.h"

#include "frames/flight_log.h"
#include "output/output_folder.h"
#include "output/summary.h"
#include "trade/table/trade_document.h"
#include "trade/trade_report.h"

#include <fmt/format.h>

#include <memory>
#include <utility>

namespace terrane::tools {

CommandResult<void> run_comparison(const ComparisonOptions& options) {
    std::vector<nlohmann::ordered_json> documents;
    for (const std::string& path : options.files) {
        CommandResult<nlohmann::ordered_json> document = read_trade_document(path);
        if (!document) return pass_on(document.error());
        documents.push_back(std::move(*document));
    }
    const nlohmann::ordered_json compared = compare_documents(documents[0], documents[1]);
    if (compared["figures_in_both"] == 0) {
        return failure(fmt::format("'{}' and '{}' have no figure in common", options.files[0],
                                   options.files[1]));
    }
    nlohmann::ordered_json summary = compared;
    summary.erase("figures");
    if (!options.out.empty()) {
        const auto folder = OutputFolder::open(options.out, {kReportName}, false);
        if (!folder) return pass_on(folder.error());
        if (const Result<void> cleared = (*folder)->clear(); !cleared) {
            return pass_on(cleared.error());
        }
        const Result<void> written = write_trade_report(OutputPlace(*folder, kReportName),
                                                        {.title = "Trade-offs of two runs",
                                                         .command_line = own_command_line(),
                                                         .film = "",
                                                         .summary = summary},
                                                        documents);
        if (!written) return pass_on(written.error());
    }
    if (options.json) {
        print_summary(compared, true);
        return {};
    }
    for (const nlohmann::ordered_json& figure : compared["figures"]) {
        if (!figure.contains("ratio_b_over_a") || !figure["b_over_a"].is_number()) continue;
        fmt::print("{:<18} {:<14} {:<22} {:<12} {:>10.4g} {:>10.4g} {:<2}  b/a {:>6.3g}\n",
                   figure["dial"].get<std::string>(), figure["terrain"].get<std::string>(),
                   figure["label"].get<std::string>(), figure["column"].get<std::string>(),
                   figure["a"].get<double>(), figure["b"].get<double>(),
                   figure["unit"].get<std::string>(), figure["b_over_a"].get<double>());
    }
    print_summary(summary, false);
    return {};
}

}  // namespace terrane::tools
