// SPDX-License-Identifier: MIT
#include <terrane/terrain/number_text.h>

#include <charconv>

namespace terrane {

std::string number_text(double value) {
    char text[32];
    const std::to_chars_result end =
        std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6);
    return {text, end.ptr};
}

}  // namespace terrane
