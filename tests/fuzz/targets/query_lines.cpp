// SPDX-License-Identifier: MIT
// Lines of `terrane query`: parsed, and answered on a small fractal.
#include "program/summary.h"
#include "query/answers.h"
#include "support/input.h"

#include <cmath>

using namespace terrane;

namespace {

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
    static tools::QueryGround ground =
        tools::QueryGround::create(fuzz::make_square(800.0, 6),
                                   {.memory_bytes = std::size_t{64} << 20})
            .value();
    fuzz::Input input(data, size);
    for (const std::string_view line : input.rest_as_lines(size)) answer(line, ground);
    return 0;
}
