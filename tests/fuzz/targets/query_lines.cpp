// SPDX-License-Identifier: MIT
// Lines of `terrane query`: parsed, and answered on a small fractal.
#include "program/summary.h"
#include "query/answers.h"
#include "support/input.h"

#include <terrane/terrain/fractal_heights.h>

#include <cmath>

using namespace terrane;

namespace {

/// One root square of 128 x 128 cells of 64 m.
tools::QueryGround make_ground() {
    const FractalSettings settings{.seed = 7,
                                   .octave_count = 6,
                                   .finest_spacing_log2 = 6,
                                   .root_size_log2 = 13,
                                   .first_root_x = 0,
                                   .first_root_y = 0,
                                   .root_count_x = 1,
                                   .root_count_y = 1};
    return tools::QueryGround::create(FractalHeights::create(settings).value(),
                                      {.memory_bytes = std::size_t{64} << 20})
        .value();
}

bool is_finite(const nlohmann::ordered_json& value) {
    if (value.is_number_float()) return std::isfinite(value.get<double>());
    if (!value.is_structured()) return true;
    for (const auto& item : value) {
        if (!is_finite(item)) return false;
    }
    return true;
}

void answer(std::string_view line, tools::QueryGround& ground) {
    const tools::QueryLine question = tools::parse_query(line);
    nlohmann::ordered_json answer = tools::answer_query(question, ground);
    const std::string text = tools::to_line(answer);
    fuzz::require(text.find('\n') == std::string::npos, "an answer is one line");
    fuzz::require(answer.is_object() && answer.contains("status"), "an answer has a status");
    answer.erase("id");
    fuzz::require(is_finite(answer), "numbers of an answer are finite: " + text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static tools::QueryGround ground = make_ground();
    fuzz::Input input(data, size);
    std::string_view text = input.rest_as_text();
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        answer(text.substr(0, end), ground);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return 0;
}
