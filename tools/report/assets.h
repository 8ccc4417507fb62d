// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace terrane::tools::assets {

// Texts embedded by the build: see embed.cmake.
extern const std::string_view report_html;
extern const std::string_view report_js;
extern const std::string_view flight_js;
extern const std::string_view paging_js;
extern const std::string_view study_js;
extern const std::string_view culling_js;
extern const std::string_view trade_js;
extern const std::string_view chart_js;

}  // namespace terrane::tools::assets
